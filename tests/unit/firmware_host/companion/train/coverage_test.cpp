#include "firmware_host/companion/train/coverage.hpp"

#include <gtest/gtest.h>

#include <array>

#include "firmware_host/companion/train/train.hpp"
#include "tests/support/pack_samples/tiny_rig.hpp"

namespace rig::host {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST(CoverageOf, CountsFramesByTheirNearestReference) {
    MatrixXd points(10, 1);
    points << 0, 1, 2, 3, 4, 5, 6, 7, 8, 9;
    MatrixXd centres(2, 1);
    centres << 0, 9;
    VectorXd widths(2);
    widths << 2.0, 0.5;
    const Coverage coverage = coverage_of(points, centres, widths);
    EXPECT_EQ(coverage.frames, 10U);
    // widths: 0 .5 1 1.5 2 2.5 3 3.5 (from 0) | 8: 2 from 9, 9: 0
    EXPECT_DOUBLE_EQ(coverage.covered_share, 0.4);
    EXPECT_DOUBLE_EQ(coverage.lost_share, 0.1);
    EXPECT_DOUBLE_EQ(coverage.widths[0], 1.5);
    EXPECT_DOUBLE_EQ(coverage.widths[3], 3.5);
    EXPECT_DOUBLE_EQ(coverage.distance_mm[3], 4.0);
    EXPECT_NEAR(coverage.spread_mm * coverage.spread_mm, 8.25, 1e-12);
}

TEST(CoverageOf, IsCompleteAtTheReferencesAndEmptyWithoutThem) {
    const MatrixXd points = MatrixXd::Random(20, 3);
    const Coverage all = coverage_of(points, points, VectorXd::Constant(20, 1e-3));
    EXPECT_EQ(all.covered_share, 1.0);
    EXPECT_EQ(all.widths[3], 0.0);
    const Coverage none = coverage_of(points, MatrixXd(0, 3), VectorXd(0));
    EXPECT_EQ(none.frames, 0U);
    EXPECT_EQ(none.covered_share, 0.0);
}

TEST(CoverageOfTakes, MoreReferencesComeNearer) {
    const test::TinyRig tiny = test::tiny_rig(24, 5, 400);
    double before = 1e9;
    for (const std::size_t centres : {5UL, 20UL, 80UL}) {
        TrainOptions options;
        options.solver = SolverKind::kRbf;
        options.takes = {tiny.take};
        options.rbf.centres = centres;
        options.rbf.dimensions = 4;
        const auto trained = train(tiny.rig, tiny.layout, options);
        ASSERT_TRUE(trained) << trained.error().message;
        ASSERT_TRUE(trained->report.coverage);
        const Coverage& coverage = *trained->report.coverage;
        EXPECT_EQ(coverage.frames, 400U);
        EXPECT_LT(coverage.distance_mm[1], before);
        EXPECT_LT(coverage.distance_mm[1], coverage.spread_mm);
        before = coverage.distance_mm[1];
    }
}

TEST(CoverageOfTakes, ATakeUnlikeTheReferencesIsNotCovered) {
    const test::TinyRig tiny = test::tiny_rig(24, 5, 400);
    TrainOptions options;
    options.solver = SolverKind::kRbf;
    options.takes = {tiny.take};
    options.rbf.centres = 60;
    const auto trained = train(tiny.rig, tiny.layout, options);
    ASSERT_TRUE(trained) << trained.error().message;
    Take wild = tiny.take;
    for (float& w : wild.weights) w = 3.0F + w;
    const SolvePack pack = trained->view();
    const Coverage strange = coverage_of_takes(pack.rbf, pack.neutral_mm, pack.basis_mm, std::array{wild});
    EXPECT_GT(trained->report.coverage->covered_share, 0.5);
    EXPECT_LT(strange.covered_share, 0.5 * trained->report.coverage->covered_share);
    EXPECT_GT(strange.widths[0], trained->report.coverage->widths[3]);
}

}  // namespace
}  // namespace rig::host
