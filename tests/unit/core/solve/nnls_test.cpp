#include "core/solve/nnls.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "tests/support/random.hpp"
#include "tests/support/reference_qp.hpp"

namespace rig {
namespace {

struct Fit {
    Fit(std::size_t rows, std::size_t count, std::vector<double> shapes, const std::vector<double>& target)
        : n(count), hessian(count * count, 0.0), linear(count, 0.0) {
        for (std::size_t r = 0; r < rows; ++r) {
            for (std::size_t i = 0; i < n; ++i) {
                linear[i] += shapes[r * n + i] * target[r];
                for (std::size_t j = 0; j < n; ++j)
                    hessian[i * n + j] += shapes[r * n + i] * shapes[r * n + j];
            }
        }
    }
    [[nodiscard]] NnlsProblem view() const { return {n, n, hessian, linear}; }

    std::size_t n;
    std::vector<double> hessian;
    std::vector<double> linear;
};

BoxQpReport solve_with(const Fit& fit, NnlsState& state, std::vector<double>& w) {
    static const auto workspace = std::make_unique<NnlsWorkspace>();
    w.assign(fit.n, -1.0);
    return solve_nnls(fit.view(), state, *workspace, w);
}

std::vector<double> random_shapes(std::size_t rows, std::size_t n, test::SeededRandom& random) {
    std::vector<double> s(rows * n);
    for (double& x : s) x = random.normal(0.0, 1.0);
    return s;
}

TEST(Nnls, FindsTheWeightsThatWereMade) {
    test::SeededRandom random(1);
    const std::vector<double> shapes = random_shapes(20, 4, random);
    const std::vector<double> truth{0.0, 0.7, 0.0, 1.4};
    std::vector<double> target(20, 0.0);
    for (std::size_t r = 0; r < 20; ++r) {
        for (std::size_t i = 0; i < 4; ++i) target[r] += shapes[r * 4 + i] * truth[i];
    }
    NnlsState state;
    std::vector<double> w;
    EXPECT_TRUE(solve_with({20, 4, shapes, target}, state, w).optimal);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(w[i], truth[i], 1e-7);
}

TEST(Nnls, EqualsTheExhaustiveReference) {
    test::SeededRandom random(2);
    for (int round = 0; round < 200; ++round) {
        const std::size_t n = 1 + random.below(7);
        std::vector<double> target(12);
        for (double& x : target) x = random.normal(0.0, 2.0);
        const Fit fit(12, n, random_shapes(12, n, random), target);
        test::ReferenceQp reference;
        reference.size = n;
        reference.hessian.assign(fit.hessian.begin(), fit.hessian.end());
        for (std::size_t i = 0; i < n; ++i) {
            reference.linear.push_back(-static_cast<long double>(fit.linear[i]));
            reference.low.push_back(0.0L);
            reference.high.push_back(std::numeric_limits<long double>::infinity());
        }
        NnlsState state;
        std::vector<double> w;
        ASSERT_TRUE(solve_with(fit, state, w).optimal);
        const std::vector<long double> best = test::solve_exhaustively(reference);
        for (std::size_t i = 0; i < n; ++i) ASSERT_NEAR(w[i], static_cast<double>(best[i]), 1e-6) << round;
    }
}

// Duplicates, an empty shape and more shapes than rows: as good as the solution of a set that is independent.
TEST(Nnls, DependentShapesEndOptimal) {
    test::SeededRandom random(3);
    for (int round = 0; round < 100; ++round) {
        std::vector<double> shapes = random_shapes(6, 12, random);
        for (std::size_t r = 0; r < 6; ++r) {
            shapes[r * 12 + 3] = shapes[r * 12];
            shapes[r * 12 + 7] = 0.0;
        }
        std::vector<double> target(6);
        for (double& x : target) x = random.normal(0.0, 1.0);
        const Fit fit(6, 12, shapes, target);
        NnlsState state;
        std::vector<double> w;
        const BoxQpReport report = solve_with(fit, state, w);
        ASSERT_TRUE(report.optimal) << round;
        double gain = 0.0;
        for (std::size_t i = 0; i < 12; ++i) {
            ASSERT_GE(w[i], 0.0);
            double gradient = -fit.linear[i];
            for (std::size_t j = 0; j < 12; ++j) gradient += fit.hessian[i * 12 + j] * w[j];
            gain = std::max(gain, w[i] > 0.0 ? std::fabs(gradient) : -gradient);
        }
        EXPECT_LT(gain, 1e-5);
    }
}

TEST(Nnls, NoDataIsNoShape) {
    NnlsState state;
    std::vector<double> w;
    EXPECT_TRUE(solve_with({1, 3, {0, 0, 0}, {5}}, state, w).optimal);
    EXPECT_EQ(w, (std::vector<double>{0, 0, 0}));
}

TEST(Nnls, WarmAndColdAgreeAndAStateOfAnotherSizeIsNotBelieved) {
    test::SeededRandom random(4);
    const std::vector<double> shapes = random_shapes(30, 10, random);
    NnlsState warm;
    for (int frame = 0; frame < 50; ++frame) {
        std::vector<double> target(30);
        for (double& x : target) x = random.normal(0.0, 1.0);
        const Fit fit(30, 10, shapes, target);
        std::vector<double> a;
        std::vector<double> b;
        ASSERT_TRUE(solve_with(fit, warm, a).optimal);
        NnlsState cold;
        ASSERT_TRUE(solve_with(fit, cold, b).optimal);
        for (std::size_t i = 0; i < 10; ++i) ASSERT_NEAR(a[i], b[i], 1e-8);
    }
    std::vector<double> w;
    EXPECT_TRUE(
        solve_with({30, 2, random_shapes(30, 2, random), std::vector<double>(30, 1.0)}, warm, w).optimal);
}

}  // namespace
}  // namespace rig
