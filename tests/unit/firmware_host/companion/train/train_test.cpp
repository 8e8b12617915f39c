#include "firmware_host/companion/train/train.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "firmware_host/companion/train/pack_writer.hpp"
#include "firmware_host/companion/train/take_statistics.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"
#include "tests/support/pack_samples/tiny_rig.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::host {
namespace {

using test::TempFolder;
using test::tiny_rig;
using test::TinyRig;

void expect_equal(std::span<const float> got, std::span<const float> wanted) {
    ASSERT_EQ(got.size(), wanted.size());
    if (wanted.empty()) return;
    EXPECT_EQ(std::memcmp(got.data(), wanted.data(), got.size_bytes()), 0);
}

void expect_round_trip(const TrainedPack& trained) {
    const TempFolder folder;
    const auto saved = save_pack(folder / "face.pack", trained.view(), {.name = "tiny"});
    ASSERT_TRUE(saved.has_value()) << saved.error().message;
    const auto opened = open_pack_file(folder / "face.pack");
    ASSERT_TRUE(opened.has_value()) << opened.error().message;
    const SolvePack& pack = opened->pack();
    expect_equal(pack.neutral_mm, trained.neutral_mm);
    expect_equal(pack.basis_mm, trained.basis_mm);
    expect_equal(pack.weight_low, trained.weight_low);
    expect_equal(pack.weight_high, trained.weight_high);
    expect_equal(pack.prior_mean, trained.prior_mean);
    expect_equal(pack.prior_sigma, trained.prior_sigma);
    expect_equal(pack.temporal_gamma, trained.temporal_gamma);
    expect_equal(pack.rbf.mean_mm, trained.rbf.mean_mm);
    expect_equal(pack.rbf.basis, trained.rbf.basis);
    expect_equal(pack.rbf.centres, trained.rbf.centres);
    expect_equal(pack.rbf.widths_mm, trained.rbf.widths_mm);
    expect_equal(pack.rbf.weights, trained.rbf.weights);
    expect_equal(pack.rbf.offset, trained.rbf.offset);
    EXPECT_EQ(pack.solver, trained.solver);
    EXPECT_EQ(pack.rate_hz, static_cast<float>(trained.rate_hz));
    EXPECT_EQ(pack.noise_mm, static_cast<float>(trained.noise_mm));
    EXPECT_EQ(pack.sparsity_mm2, static_cast<float>(trained.sparsity_mm2));
    EXPECT_EQ(pack.ridge_mm2, static_cast<float>(trained.ridge_mm2));
    for (std::size_t i = 0; i < trained.shape_names.size(); ++i)
        EXPECT_EQ(pack.shape_names[i], trained.shape_names[i]);
    for (std::size_t k = 0; k < trained.marker_names.size(); ++k)
        EXPECT_EQ(pack.marker_names[k], trained.marker_names[k]);
}

TEST(Train, WhatIsTrainedIsWhatIsOpened) {
    const TinyRig tiny = tiny_rig(24, 5, 200);
    for (const SolverKind solver :
         {SolverKind::kLeastSquares, SolverKind::kNonNegative, SolverKind::kBoxQp, SolverKind::kRbf}) {
        TrainOptions options;
        options.solver = solver;
        options.takes = {tiny.take};
        options.rbf.centres = 12;
        const auto trained = train(tiny.rig, tiny.layout, options);
        ASSERT_TRUE(trained.has_value()) << trained.error().message;
        expect_round_trip(*trained);
    }
}

TEST(Train, TakesTheSmallestAndTheLargestRigs) {
    for (const auto& [markers, shapes] :
         {std::pair<std::size_t, std::size_t>{20, 1}, {kMaxMarkers, kMaxShapes}}) {
        const TinyRig tiny = tiny_rig(markers, shapes, 2);
        const auto trained = train(tiny.rig, tiny.layout, {});
        ASSERT_TRUE(trained.has_value()) << trained.error().message;
        expect_round_trip(*trained);
    }
}

TEST(Train, RefusesSizesAPackCannotHold) {
    const auto fault = [](std::size_t markers, std::size_t shapes) {
        const TinyRig tiny = tiny_rig(markers, shapes, 2);
        const auto trained = train(tiny.rig, tiny.layout, {});
        return trained ? std::string() : trained.error().message;
    };
    EXPECT_NE(fault(3, 5).find("3 markers"), std::string::npos);
    EXPECT_NE(fault(129, 5).find("129 markers"), std::string::npos);
    EXPECT_NE(fault(20, 0).find("0 shapes"), std::string::npos);
    EXPECT_NE(fault(20, 257).find("257 shapes"), std::string::npos);
    TinyRig tiny = tiny_rig(20, 3, 2);
    tiny.rig.shapes[1].name = std::string(64, 'x');
    const auto trained = train(tiny.rig, tiny.layout, {});
    ASSERT_FALSE(trained.has_value());
    EXPECT_NE(trained.error().message.find("plain text"), std::string::npos);
}

TEST(Train, RefusesOptionsOutOfRange) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto fault = [](auto change) {
        TrainOptions options;
        change(options);
        return fault_of_options(options, 0);
    };
    EXPECT_EQ(fault([](TrainOptions&) {}), "");
    for (const double bad : {nan, 0.0, -1.0, 1e9}) {
        EXPECT_NE(fault([&](TrainOptions& o) { o.rate_hz = bad; }), "");
        EXPECT_NE(fault([&](TrainOptions& o) { o.noise_mm = bad; }), "");
        EXPECT_NE(fault([&](TrainOptions& o) { o.temporal.step = bad; }), "");
    }
    for (const double bad : {nan, -1.0, 1e9}) {
        EXPECT_NE(fault([&](TrainOptions& o) { o.sparsity = bad; }), "");
        EXPECT_NE(fault([&](TrainOptions& o) { o.ridge = bad; }), "");
    }
    EXPECT_NE(fault([](TrainOptions& o) { o.cameras.resize(5); }), "");
}

TEST(Train, RegularisationIsRelativeToTheNoise) {
    const TinyRig tiny = tiny_rig(20, 3, 2);
    TrainOptions options;
    options.noise_mm = 0.2;
    options.sparsity = 0.5;
    options.ridge = 0.25;
    const auto box = train(tiny.rig, tiny.layout, options);
    ASSERT_TRUE(box.has_value());
    EXPECT_DOUBLE_EQ(box->sparsity_mm2, 0.5 * 60 * 0.04);
    EXPECT_DOUBLE_EQ(box->ridge_mm2, 0.25 * 60 * 0.04);
    // gamma = s^2 / s_step^2, methods.md 3.7
    EXPECT_NEAR(static_cast<double>(box->temporal_gamma[0]), 0.04 / (kDefaultStepAt60Hz * kDefaultStepAt60Hz),
                1e-4);
    options.temporal = {TemporalPull::Mode::kOn, 0.1};
    EXPECT_NEAR(static_cast<double>(train(tiny.rig, tiny.layout, options)->temporal_gamma[2]), 4.0, 1e-6);
    options.temporal = {TemporalPull::Mode::kOff, {}};
    EXPECT_EQ(train(tiny.rig, tiny.layout, options)->temporal_gamma[2], 0.0F);
}

TEST(Train, TheSourcesOwnSolversStayPlain) {
    const TinyRig tiny = tiny_rig(20, 3, 2);
    for (const SolverKind solver : {SolverKind::kLeastSquares, SolverKind::kNonNegative}) {
        TrainOptions options;
        options.solver = solver;
        const auto trained = train(tiny.rig, tiny.layout, options);
        ASSERT_TRUE(trained.has_value());
        EXPECT_EQ(trained->sparsity_mm2, 0.0);
        EXPECT_EQ(trained->ridge_mm2, 0.0);
        EXPECT_EQ(trained->temporal_gamma, std::vector<float>(3, 0.0F));
    }
}

TEST(Train, ReportsRankAndInvisibleShapes) {
    TinyRig tiny = tiny_rig(20, 4, 2);
    const auto good = train(tiny.rig, tiny.layout, {});
    ASSERT_TRUE(good.has_value());
    EXPECT_EQ(good->report.rank, 4U);
    EXPECT_TRUE(good->report.invisible.empty());
    // A double of shape 0 and a shape that moves nothing.
    tiny.rig.shapes.push_back(tiny.rig.shapes[0]);
    tiny.rig.shapes.back().name = "double";
    tiny.rig.shapes.push_back({.name = "nothing", .vertices = {}, .delta_mm = {}});
    const auto poor = train(tiny.rig, tiny.layout, {});
    ASSERT_TRUE(poor.has_value());
    EXPECT_EQ(poor->report.rank, 4U);
    ASSERT_EQ(poor->report.invisible.size(), 1U);
    EXPECT_EQ(poor->report.invisible[0].name, "nothing");
    EXPECT_EQ(poor->report.invisible[0].column_mm, 0.0);
    EXPECT_GE(good->report.condition, 1.0);
}

TEST(Train, TheRecordedHeadWithEveryLayout) {
    RIG_SHARED_DATA_OR_SKIP(path, "rig");
    const auto rig = load_rig(path);
    ASSERT_TRUE(rig.has_value()) << rig.error().message;
    for (const char* count : {"50", "60", "102"}) {
        const auto layout = load_layout(path, count, *rig);
        ASSERT_TRUE(layout.has_value()) << layout.error().message;
        const auto trained = train(*rig, *layout, {});
        ASSERT_TRUE(trained.has_value()) << trained.error().message;
        EXPECT_EQ(trained->report.rank, 53U);
        // 50 and 60 markers hardly see the lids; 102 do.
        EXPECT_EQ(trained->report.invisible.empty(), std::string_view(count) == "102");
        expect_round_trip(*trained);
    }
}

}  // namespace
}  // namespace rig::host
