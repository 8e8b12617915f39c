#include "firmware_host/companion/train/gcv.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "tests/support/random.hpp"

namespace rig::host {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Regression {
    MatrixXd h;
    VectorXd y;
    VectorXd eigenvalues;
    VectorXd targets;
};

// 40 samples of a smooth function of 25 Gaussian bumps, with noise.
Regression random_regression(test::SeededRandom& random, double noise) {
    Regression out{MatrixXd(40, 25), VectorXd(40), {}, {}};
    VectorXd w(25);
    for (double& x : w) x = random.normal(0.0, 1.0);
    for (Eigen::Index i = 0; i < 40; ++i) {
        for (Eigen::Index k = 0; k < 25; ++k) {
            const double gap = static_cast<double>(i) / 40.0 - static_cast<double>(k) / 25.0;
            out.h(i, k) = std::exp(-gap * gap / 0.02);
        }
    }
    out.y = out.h * w;
    for (double& y : out.y) y += random.normal(0.0, noise);
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(out.h * out.h.transpose());
    out.eigenvalues = eigen.eigenvalues().cwiseMax(0.0);
    out.targets = eigen.eigenvectors().transpose() * out.y;
    return out;
}

TEST(Gcv, IsTheFormulaOfItsDefinition) {
    test::SeededRandom random(51);
    const Regression r = random_regression(random, 0.1);
    for (const double lambda : {1e-3, 0.1, 3.0}) {
        const MatrixXd a = r.h.transpose() * r.h + lambda * MatrixXd::Identity(25, 25);
        const MatrixXd p = MatrixXd::Identity(40, 40) - r.h * a.inverse() * r.h.transpose();
        const double wanted = 40.0 * (p * r.y).squaredNorm() / (p.trace() * p.trace());
        EXPECT_NEAR(gcv_at(r.eigenvalues, r.targets, lambda), wanted, 1e-8 * wanted) << lambda;
    }
}

TEST(MinimiseGcv, EndsWhereTheDerivativeVanishes) {
    test::SeededRandom random(52);
    for (int round = 0; round < 50; ++round) {
        const Regression r = random_regression(random, random.uniform(0.05, 1.0));
        const GcvPath path = minimise_gcv(r.eigenvalues, r.targets, 1e-12);
        const GcvStep end = path.back();
        ASSERT_LT(path.size(), 200U) << "it converges";
        EXPECT_DOUBLE_EQ(end.gcv, gcv_at(r.eigenvalues, r.targets, end.lambda));
        // The slope against ln lambda, in units of GCV: under what the threshold leaves.
        const double up = gcv_at(r.eigenvalues, r.targets, end.lambda * 1.01);
        const double down = gcv_at(r.eigenvalues, r.targets, end.lambda / 1.01);
        EXPECT_LE(std::abs(up - down) / (0.02 * end.gcv), 5e-3) << round;
        EXPECT_LE(end.gcv, path.front().gcv * (1.0 + 1e-6));
    }
}

TEST(MinimiseGcv, StaysInsideItsBounds) {
    test::SeededRandom random(53);
    const Regression clean = random_regression(random, 0.0);
    EXPECT_DOUBLE_EQ(minimise_gcv(clean.eigenvalues, clean.targets, 0.5).back().lambda, 0.5)
        << "clean data want no ridge; the floor holds";
    const VectorXd nothing = VectorXd::Zero(40);
    const GcvPath path = minimise_gcv(clean.eigenvalues, nothing, 1e-6);
    ASSERT_GE(path.size(), 1U);
    EXPECT_TRUE(std::isfinite(path.back().lambda));
    EXPECT_EQ(path.back().gcv, 0.0);
    VectorXd noise(40);
    for (double& y : noise) y = random.normal(0.0, 1.0);
    EXPECT_LE(minimise_gcv(clean.eigenvalues, noise, 1e-6).back().lambda, 1e3 * clean.eigenvalues.maxCoeff());
}

}  // namespace
}  // namespace rig::host
