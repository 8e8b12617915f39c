#include "core/solve/rbf.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
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
        return evaluate_rbf(sample_.view, t, workspace_, weights_);
    }

    SamplePack sample_;
    RbfWorkspace workspace_;
    std::vector<double> weights_ = std::vector<double>(2);
};

TEST_F(OneCentre, IsTheReferenceAtTheCentre) {
    sample_.rbf_mean.assign(12, 0.0F);  // so that the sums below are exact
    const RbfReport report = evaluate(3.0F, 4.0F);
    EXPECT_DOUBLE_EQ(weights_[0], 0.625);
    EXPECT_DOUBLE_EQ(weights_[1], 0.25);
    EXPECT_EQ(report.nearest_widths, 0.0);
    EXPECT_EQ(report.weights_clamped, 0);
}

TEST_F(OneCentre, FallsOffAsTheGaussian) {
    sample_.rbf_mean.assign(12, 0.0F);
    const RbfReport report = evaluate(0.0F, 0.0F);  // 5 mm away: 2.5 widths
    EXPECT_DOUBLE_EQ(report.nearest_widths, 2.5);
    EXPECT_NEAR(weights_[0], 0.125 + 0.5 * std::exp(-0.5 * 6.25), 1e-15);
    EXPECT_NEAR(weights_[1], 0.5 - 0.25 * std::exp(-0.5 * 6.25), 1e-15);
}

TEST_F(OneCentre, IsTheOffsetFarAway) {
    const RbfReport report = evaluate(5000.0F, 0.0F);
    EXPECT_EQ(weights_[0], 0.125);
    EXPECT_EQ(weights_[1], 0.5);
    EXPECT_GT(report.nearest_widths, 2000.0);
}

TEST_F(OneCentre, ClampsAndCounts) {
    sample_.rbf_offset[0] = 3.0F;
    sample_.rbf_offset[1] = -1.0F;
    const RbfReport report = evaluate(3.0F, 4.0F);
    EXPECT_EQ(weights_[0], 1.0);
    EXPECT_EQ(weights_[1], 0.0);
    EXPECT_EQ(report.weights_clamped, 2);
}

TEST_F(OneCentre, TakesTheMeanForWhatIsNoPosition) {
    std::vector<float> t = sample_.rbf_mean;
    const RbfReport clean = evaluate_rbf(sample_.view, t, workspace_, weights_);
    const std::vector<double> wanted = weights_;
    EXPECT_EQ(clean.coordinates_replaced, 0);
    t[0] = kNan;
    t[1] = std::numeric_limits<float>::infinity();
    t[5] = -3e38F;
    const RbfReport report = evaluate_rbf(sample_.view, t, workspace_, weights_);
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
    RbfWorkspace workspace;
    std::vector<double> weights(2);
    const RbfReport report = evaluate_rbf(sample.view, t, workspace, weights);
    EXPECT_EQ(report.nearest_centre, 1);
    EXPECT_DOUBLE_EQ(report.nearest_widths, 1.2);
}

}  // namespace
}  // namespace rig
