#include "core/solve/rbf.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "tests/support/pack_samples/sample_pack.hpp"

namespace rig {
namespace {

using test::SamplePack;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// Four markers, two components that are the first two coordinates, one centre at (3, 4) of width 2.
class OneCentre : public testing::Test {
  protected:
    OneCentre() : sample_({.solver = SolverKind::kRbf, .rbf_dimensions = 2, .rbf_centres = 1}) {
        sample_.rbf_centres = {3.0F, 4.0F};
        sample_.rbf_widths = {2.0F};
        sample_.rbf_weights = {0.5F, -0.25F};
        sample_.rbf_offset = {0.125F, 0.5F};
        sample_.view.rbf.centres = sample_.rbf_centres;
        sample_.view.rbf.widths_mm = sample_.rbf_widths;
        sample_.view.rbf.weights = sample_.rbf_weights;
        sample_.view.rbf.offset = sample_.rbf_offset;
    }
    RbfReport evaluate(float x, float y) {
        std::vector<float> t = sample_.rbf_mean;
        t[0] += x;
        t[1] += y;
        return evaluate(t);
    }

    RbfReport evaluate(const std::vector<float>& t) {
        build_rbf_tables(sample_.view, *tables_);
        return evaluate_rbf(*tables_, t, workspace_, weights_);
    }

    SamplePack sample_;
    std::unique_ptr<RbfTables> tables_ = std::make_unique<RbfTables>();
    RbfWorkspace workspace_;
    std::vector<float> weights_ = std::vector<float>(2);
};

TEST_F(OneCentre, IsTheReferenceAtTheCentre) {
    sample_.rbf_mean.assign(12, 0.0F);  // so that the sums below are exact
    const RbfReport report = evaluate(3.0F, 4.0F);
    EXPECT_FLOAT_EQ(weights_[0], 0.625F);
    EXPECT_FLOAT_EQ(weights_[1], 0.25F);
    EXPECT_EQ(report.nearest_widths, 0.0F);
    EXPECT_EQ(report.weights_clamped, 0);
}

TEST_F(OneCentre, FallsOffAsTheGaussian) {
    sample_.rbf_mean.assign(12, 0.0F);
    const RbfReport report = evaluate(0.0F, 0.0F);  // 5 mm away: 2.5 widths
    EXPECT_FLOAT_EQ(report.nearest_widths, 2.5F);
    EXPECT_NEAR(weights_[0], 0.125 + 0.5 * std::exp(-0.5 * 6.25), 3e-8);
    EXPECT_NEAR(weights_[1], 0.5 - 0.25 * std::exp(-0.5 * 6.25), 6e-8);
}

TEST_F(OneCentre, HasTheOtherKernels) {
    sample_.rbf_mean.assign(12, 0.0F);
    sample_.view.rbf.kernel = RbfKernel::kMultiquadric;
    static_cast<void>(evaluate(0.0F, 4.0F));  // 3 mm away: 1.5 widths
    EXPECT_NEAR(weights_[1], 0.5 - 0.25 * std::sqrt(1.0 + 2.25), 6e-8);
    sample_.view.rbf.kernel = RbfKernel::kThinPlate;
    static_cast<void>(evaluate(0.0F, 4.0F));
    EXPECT_NEAR(weights_[0], 0.125 + 0.5 * (2.25 * std::log(1.5)), 6e-8);
    static_cast<void>(evaluate(3.0F, 4.0F));
    EXPECT_EQ(weights_[0], 0.125F) << "r^2 ln r is 0 at the centre";
}

TEST_F(OneCentre, SaysHowMuchShouldBeTheBoxQps) {
    sample_.rbf_mean.assign(12, 0.0F);
    EXPECT_EQ(evaluate(5000.0F, 0.0F).hull_share, 0.0F) << "off unless the pack says so";
    sample_.view.rbf.hull_near_widths = 1.0F;
    sample_.view.rbf.hull_far_widths = 2.0F;
    EXPECT_EQ(evaluate(3.0F, 2.0F).hull_share, 0.0F);  // 1 width away
    EXPECT_EQ(evaluate(3.0F, 1.0F).hull_share, 0.5F);  // 1.5
    EXPECT_EQ(evaluate(3.0F, 0.0F).hull_share, 1.0F);  // 2
    EXPECT_EQ(evaluate(5000.0F, 0.0F).hull_share, 1.0F);
}

TEST(HullShare, RisesWithoutJumpOrCorner) {
    constexpr float kStep = 1e-3F;
    float last = 0.0F;
    float last_slope = 0.0F;
    for (int i = 1; i < 6000; ++i) {
        const float share = hull_share(static_cast<float>(i) * kStep, 1.5F, 4.0F);
        const float slope = (share - last) / kStep;
        ASSERT_GE(share, last);
        ASSERT_LE(slope, 1.5F / 2.5F + 1e-3F) << "the steepest of 3 s^2 - 2 s^3";
        ASSERT_LE(std::abs(slope - last_slope), 2e-3F) << i;
        last = share;
        last_slope = slope;
    }
    EXPECT_EQ(last, 1.0F);
    EXPECT_EQ(hull_share(0.0F, 0.0F, 0.0F), 0.0F);
    EXPECT_EQ(hull_share(1e9F, 0.0F, 0.0F), 0.0F);
}

TEST_F(OneCentre, IsTheOffsetFarAway) {
    const RbfReport report = evaluate(5000.0F, 0.0F);
    EXPECT_EQ(weights_[0], 0.125F);
    EXPECT_EQ(weights_[1], 0.5F);
    EXPECT_GT(report.nearest_widths, 2000.0F);
}

TEST_F(OneCentre, ClampsAndCounts) {
    sample_.rbf_offset[0] = 3.0F;
    sample_.rbf_offset[1] = -1.0F;
    const RbfReport report = evaluate(3.0F, 4.0F);
    EXPECT_EQ(weights_[0], 1.0F);
    EXPECT_EQ(weights_[1], 0.0F);
    EXPECT_EQ(report.weights_clamped, 2);
}

TEST_F(OneCentre, TakesTheMeanForWhatIsNoPosition) {
    std::vector<float> t = sample_.rbf_mean;
    const RbfReport clean = evaluate(t);
    const std::vector<float> wanted = weights_;
    EXPECT_EQ(clean.coordinates_replaced, 0);
    t[0] = kNan;
    t[1] = std::numeric_limits<float>::infinity();
    t[5] = -3e38F;
    const RbfReport report = evaluate(t);
    EXPECT_EQ(report.coordinates_replaced, 3);
    EXPECT_EQ(weights_, wanted);
}

TEST(Rbf, SaysWhichCentreIsNearestInItsOwnWidths) {
    SamplePack sample({.solver = SolverKind::kRbf, .rbf_dimensions = 1, .rbf_centres = 2});
    sample.rbf_mean.assign(12, 0.0F);
    sample.rbf_basis.assign(12, 0.0F);
    sample.rbf_basis[0] = 1.0F;
    sample.rbf_centres = {0.0F, 10.0F};
    sample.rbf_widths = {1.0F, 5.0F};
    sample.view.rbf.basis = sample.rbf_basis;
    sample.view.rbf.centres = sample.rbf_centres;
    sample.view.rbf.widths_mm = sample.rbf_widths;
    std::vector<float> t(12, 0.0F);
    t[0] = 4.0F;  // 4 widths from the first, 1.2 from the second
    const auto tables = std::make_unique<RbfTables>();
    build_rbf_tables(sample.view, *tables);
    RbfWorkspace workspace;
    std::vector<float> weights(2);
    const RbfReport report = evaluate_rbf(*tables, t, workspace, weights);
    EXPECT_EQ(report.nearest_centre, 1);
    EXPECT_FLOAT_EQ(report.nearest_widths, 1.2F);
}

}  // namespace
}  // namespace rig
