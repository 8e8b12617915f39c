#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "firmware_host/companion/experiments/experiment.hpp"
#include "tests/support/shared_data.hpp"

namespace rig::host {
namespace {

TEST(AllExperiments, HaveNamesOfTheirOwnInOrder) {
    std::string last;
    for (const Experiment& experiment : all_experiments()) {
        EXPECT_LT(last, experiment.name);
        EXPECT_FALSE(experiment.repeats.empty());
        EXPECT_EQ(find_experiment(experiment.name), &experiment);
        last = experiment.name;
    }
    EXPECT_EQ(find_experiment("no-such-thing"), nullptr);
    EXPECT_EQ(find_experiment(""), nullptr);
}

TEST(AllExperiments, NameTheFileThatIsMissing) {
    for (const Experiment& experiment : all_experiments()) {
        const auto table = experiment.run("/no/such/folder");
        ASSERT_FALSE(table.has_value()) << experiment.name;
        EXPECT_NE(table.error().message.find("/no/such/folder"), std::string::npos) << table.error().message;
    }
}

TEST(AllBoundsHold, IsFalseForOneThatIsMissedOrNoNumber) {
    ExperimentTable table;
    EXPECT_TRUE(all_bounds_hold(table)) << "nothing claimed";
    table.bounds = {{"a", 0.5, 0.5}, {"b", -1.0, 0.0}};
    EXPECT_TRUE(all_bounds_hold(table));
    table.bounds.push_back({"c", 0.51, 0.5});
    EXPECT_FALSE(all_bounds_hold(table));
    table.bounds.back().value = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(all_bounds_hold(table));
}

void expect_bounds_hold(const char* name, const std::filesystem::path& data) {
    const Experiment* experiment = find_experiment(name);
    ASSERT_NE(experiment, nullptr) << name;
    const auto table = experiment->run(data);
    ASSERT_TRUE(table.has_value()) << table.error().message;
    EXPECT_GE(table->rows.size(), 3U);
    for (const auto& row : table->rows) EXPECT_EQ(row.size(), table->columns.size());
    // A test is never timed.
    for (const ExperimentBound& bound : table->bounds) {
        if (bound.what.find(", time,") != std::string::npos) continue;
        EXPECT_TRUE(bound.holds()) << name << ": " << bound.what << " " << bound.value;
    }
}

TEST(AllExperiments, OfKeyShapesAndRegionsHoldTheirBoundsOnTheRecordedTakes) {
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "minutes of arithmetic under the sanitizers";
#endif
    RIG_SHARED_DATA_OR_SKIP(rig, "rig");
    for (const char* name : {"chuang02-key-shapes", "chuang02-non-negative", "zhang06-regions"})
        expect_bounds_hold(name, rig.parent_path());
}

TEST(AllExperiments, OfMissingMarkersHoldTheirBoundsOnTheBuiltInHead) {
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "minutes of arithmetic under the sanitizers";
#endif
    expect_bounds_hold("missing-markers", "sample");
}

TEST(AllExperiments, OfMissingMarkersHoldTheirBoundsOnTheRecordedTakes) {
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "minutes of arithmetic under the sanitizers";
#endif
    RIG_SHARED_DATA_OR_SKIP(rig, "rig");
    for (const char* name : {"missing-markers", "zhang06-propagation"})
        expect_bounds_hold(name, rig.parent_path());
}

TEST(AllExperiments, OfTheMotionModelHoldTheirBoundsOnTheRecordedSlip) {
    RIG_SHARED_DATA_OR_SKIP(slip, "markers/facegood_3_15/60/slip.npy");
    const auto table = zhang06_motion_model(slip.parent_path().parent_path().parent_path().parent_path());
    ASSERT_TRUE(table.has_value()) << table.error().message;
    EXPECT_EQ(table->rows.size(), 2U);
    EXPECT_TRUE(all_bounds_hold(*table));
}

TEST(AllExperiments, OfDengHoldTheirBoundsOnTheRecordedTakes) {
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "minutes of arithmetic under the sanitizers";
#endif
    RIG_SHARED_DATA_OR_SKIP(rig, "rig");
    for (const char* name : {"deng06-mistracked", "deng06-proportions", "deng06-variance"}) {
        expect_bounds_hold(name, rig.parent_path());
    }
}

}  // namespace
}  // namespace rig::host
