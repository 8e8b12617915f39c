#include "firmware_host/companion/train/training_record.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace rig::host {
namespace {

TrainingRecord some_record() {
    TrainingRecord record;
    record.pack_uuid = "00112233445566778899aabbccddeeff";
    RbfTrainingReport& rbf = record.rbf;
    rbf.frames = 1234;
    rbf.dimensions = 12;
    rbf.centres = 100;
    rbf.variance_kept = 0.97;
    rbf.width_factor = 1.5;
    rbf.median_lambda = 3.5e-7;
    rbf.cross_validated_rms = 0.07;
    rbf.in_take_rms = 0.03;
    rbf.visible_in_take_rms = 0.02;
    rbf.distance_p50 = 0.1;
    rbf.distance_p95 = 0.25;
    rbf.cross_validation = {{8, 1.0, 0.09}, {12, 1.5, 0.07}};
    rbf.gcv_paths = {{{1e-2, 0.5}, {1e-3, 0.25}}, {{1e-8, 0.125}}};
    rbf.variance_shares = {0.75, 0.125};
    record.coverage.frames = 1234;
    record.coverage.covered_share = 0.99;
    record.coverage.lost_share = 0.001;
    record.coverage.widths = {0.1, 0.2, 0.5, 1.5};
    record.coverage.distance_mm = {1.0, 2.0, 5.0, 15.0};
    record.coverage.spread_mm = 20.0;
    record.shape_names = {"jawOpen", "smile left"};
    return record;
}

std::string fault_of(const std::string& text) {
    const auto record = parse_training_record(text, "face.training.csv");
    return record ? std::string() : record.error().message;
}

TEST(TrainingRecord, SurvivesItsFile) {
    const TrainingRecord record = some_record();
    const std::string text = training_record_text(record);
    const auto read = parse_training_record(text, "face.training.csv");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(training_record_text(*read), text);
    EXPECT_EQ(read->pack_uuid, record.pack_uuid);
    EXPECT_EQ(read->rbf.frames, 1234U);
    EXPECT_EQ(read->rbf.median_lambda, 3.5e-7);
    EXPECT_EQ(read->rbf.visible_in_take_rms, 0.02);
    ASSERT_EQ(read->rbf.cross_validation.size(), 2U);
    EXPECT_EQ(read->rbf.cross_validation[1].dimensions, 12U);
    EXPECT_EQ(read->rbf.cross_validation[1].weight_rms, 0.07);
    ASSERT_EQ(read->rbf.gcv_paths.size(), 2U);
    EXPECT_EQ(read->rbf.gcv_paths[0].size(), 2U);
    EXPECT_EQ(read->rbf.gcv_paths[1][0].lambda, 1e-8);
    EXPECT_EQ(read->rbf.variance_shares, record.rbf.variance_shares);
    EXPECT_EQ(read->coverage.widths, record.coverage.widths);
    EXPECT_EQ(read->coverage.distance_mm, record.coverage.distance_mm);
    EXPECT_EQ(read->coverage.spread_mm, 20.0);
    EXPECT_EQ(read->shape_names, record.shape_names);
}

TEST(TrainingRecord, LeavesOutWhatIsNoNumber) {
    TrainingRecord record = some_record();
    record.rbf.cross_validation[0].weight_rms = std::numeric_limits<double>::infinity();
    record.rbf.median_lambda = std::numeric_limits<double>::quiet_NaN();
    const auto read = parse_training_record(training_record_text(record), "f");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->rbf.cross_validation.size(), 1U);
    EXPECT_EQ(read->rbf.median_lambda, 0.0);
}

TEST(TrainingRecord, RefusesOtherTables) {
    const std::string head = "pack,curve,series,x,y\n";
    EXPECT_NE(fault_of("frame,time_s\n0,0\n").find("not a record"), std::string::npos);
    EXPECT_NE(fault_of(head).find("no rows"), std::string::npos);
    EXPECT_NE(fault_of(head + "a,figure,frames,0,1\nb,figure,frames,0,1\n").find("another pack"),
              std::string::npos);
    for (const char* row : {"a,figure,height,0,1", "a,picture,frames,0,1", "a,cross_validation,x,1,1",
                            "a,cross_validation,,1,1", "a,cross_validation,0,1,1", "a,coverage,widths,0.3,1",
                            "a,gcv,shape,nan,1", "a,gcv,shape,1,"})
        EXPECT_NE(fault_of(head + row + "\n"), "") << row;
    EXPECT_EQ(fault_of(head + "a,figure,frames,0,1\n"), "");
}

TEST(TrainingRecord, LiesBesideThePack) {
    EXPECT_EQ(training_record_path("out/face.pack"), "out/face.training.csv");
    EXPECT_EQ(training_record_path("face"), "face.training.csv");
    PackManifest manifest;
    manifest.uuid[0] = 0x0a;
    manifest.uuid[15] = 0xff;
    EXPECT_EQ(uuid_text(manifest), "0a0000000000000000000000000000ff");
}

}  // namespace
}  // namespace rig::host
