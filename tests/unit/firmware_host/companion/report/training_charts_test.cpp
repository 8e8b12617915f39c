#include "firmware_host/companion/report/training_charts.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace rig::host {
namespace {

const TrainingCurve* find(const std::vector<TrainingCurve>& curves, std::string_view start) {
    const auto at =
        std::ranges::find_if(curves, [&](const TrainingCurve& c) { return c.title.starts_with(start); });
    return at == curves.end() ? nullptr : &*at;
}

RbfTrainingReport some_report() {
    RbfTrainingReport report;
    report.dimensions = 12;
    report.width_factor = 3.0;
    report.median_lambda = 1e-3;
    report.cross_validation = {{8, 1.0, 0.30},  {8, 3.0, 0.20},  {8, 2.0, 0.25}, {4, 3.0, 0.40},
                               {12, 3.0, 0.10}, {12, 3.0, 0.10}, {12, 2.0, 0.15}};
    report.gcv_paths = {{{1e-2, 4.0}, {1e-3, 2.0}}, {{1e-2, 1.0}}, {}, {{1e-2, 0.0}}};
    report.variance_shares = {0.5, 0.25, 0.125};
    report.variance_kept = 0.875;
    return report;
}

TEST(TrainingCurves, DrawWhatWasTriedInOrder) {
    const auto curves = training_curves(some_report());
    ASSERT_EQ(curves.size(), 4U);
    const LineChart& widths = curves[0].chart;
    ASSERT_EQ(widths.series.size(), 2U);  // four components were tried with one width
    EXPECT_EQ(widths.series[0].name, "8 components");
    ASSERT_EQ(widths.series[0].points.size(), 3U);
    EXPECT_EQ(widths.series[0].points[1].x, 2.0);
    EXPECT_EQ(widths.series[0].points[1].y, 0.25);
    EXPECT_EQ(widths.series[1].points.size(), 2U);
    EXPECT_EQ(widths.marked_x, 3.0);
    const LineChart& dimensions = curves[1].chart;
    ASSERT_EQ(dimensions.series[0].points.size(), 3U);
    EXPECT_EQ(dimensions.series[0].points[1].x, 8.0);
    EXPECT_EQ(dimensions.series[0].points[1].y, 0.20);
}

TEST(TrainingCurves, GcvIsRelativeToWhereItEnds) {
    const auto curves = training_curves(some_report());
    const TrainingCurve* gcv = find(curves, "GCV path");
    ASSERT_NE(gcv, nullptr);
    ASSERT_EQ(gcv->chart.series.size(), 2U);  // a path that is empty, or at zero, has nothing to show
    EXPECT_EQ(gcv->chart.series[0].points.front().y, 2.0);
    EXPECT_EQ(gcv->chart.series[0].points.back().y, 1.0);
    EXPECT_EQ(gcv->chart.series[1].points.size(), 1U);
    EXPECT_TRUE(gcv->chart.log_x);
}

TEST(TrainingCurves, VarianceAddsUp) {
    const auto curves = training_curves(some_report());
    const TrainingCurve* variance = find(curves, "Share of the markers' variance");
    ASSERT_NE(variance, nullptr);
    EXPECT_EQ(variance->chart.series[0].points.back().y, 87.5);
}

TEST(TrainingCurves, AreLeftOutWhereNothingWasTried) {
    EXPECT_TRUE(training_curves({}).empty());
    RbfTrainingReport given = some_report();  // --dimensions: one number, several widths
    given.cross_validation = {{12, 1.0, 0.2}, {12, 2.0, 0.1}};
    EXPECT_EQ(training_curves(given).size(), 3U);
}

}  // namespace
}  // namespace rig::host
