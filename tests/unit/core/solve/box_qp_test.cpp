#include "core/solve/box_qp.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "tests/support/random.hpp"
#include "tests/support/reference_qp.hpp"

namespace rig {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Problem {
    explicit Problem(std::size_t size)
        : n(size), hessian(size * kMaxShapes, 0.0), linear(size), low(size), high(size) {}

    [[nodiscard]] BoxQpProblem view() const { return {n, hessian, linear, low, high}; }
    [[nodiscard]] test::ReferenceQp reference() const {
        test::ReferenceQp r;
        r.size = n;
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = 0; j < n; ++j)
                r.hessian.push_back(static_cast<long double>(hessian[i * kMaxShapes + j]));
            r.linear.push_back(static_cast<long double>(linear[i]));
            r.low.push_back(static_cast<long double>(low[i]));
            r.high.push_back(static_cast<long double>(high[i]));
        }
        return r;
    }

    std::size_t n;
    std::vector<double> hessian;
    std::vector<double> linear;
    std::vector<double> low;
    std::vector<double> high;
};

struct Solved {
    std::vector<double> w;
    BoxQpReport report;
};

Solved solve_from(const Problem& p, BoxQpState& state, std::vector<double> start,
                  const BoxQpConfig& config = {}) {
    static const auto workspace = std::make_unique<BoxQpWorkspace>();
    const BoxQpReport report = solve_box_qp(p.view(), config, state, *workspace, start);
    return {start, report};
}

Solved solve_cold(const Problem& p, const BoxQpConfig& config = {}) {
    BoxQpState state;
    return solve_from(p, state, std::vector<double>(p.n, 0.0), config);
}

// H = B^T B + eps I of a random B with `rows` rows, q towards a target that is partly outside the box.
Problem random_problem(std::size_t n, std::size_t rows, double ridge, test::SeededRandom& random) {
    Problem p(n);
    std::vector<double> b(rows * n);
    for (double& x : b) x = random.chance(0.3) ? 0.0 : random.normal(0.0, 1.0);
    if (n > 1 && random.chance(0.3)) {  // a copy
        for (std::size_t r = 0; r < rows; ++r) b[r * n + n - 1] = b[r * n];
    }
    if (n > 2 && random.chance(0.3)) {  // an invisible shape
        for (std::size_t r = 0; r < rows; ++r) b[r * n + 1] = 0.0;
    }
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < n; ++j) {
            for (std::size_t r = 0; r < rows; ++r)
                p.hessian[i * kMaxShapes + j] += b[r * n + i] * b[r * n + j];
        }
        p.hessian[i * kMaxShapes + i] += ridge;
    }
    std::vector<double> target(n);
    for (double& t : target) t = random.uniform(-0.6, 1.6);
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < n; ++j) p.linear[i] -= p.hessian[i * kMaxShapes + j] * target[j];
        p.linear[i] += random.normal(0.0, 0.2);
        const double kind = random.uniform(0.0, 1.0);
        p.low[i] = kind < 0.1 ? -kInfinity : (kind < 0.2 ? -0.5 : 0.0);
        p.high[i] = random.chance(0.1) ? kInfinity : 1.0;
        if (random.chance(0.05) && std::isfinite(p.low[i])) p.high[i] = p.low[i];
    }
    return p;
}

bool feasible(const Problem& p, const std::vector<double>& w) {
    for (std::size_t i = 0; i < p.n; ++i) {
        if (!(w[i] >= p.low[i] && w[i] <= p.high[i])) return false;
    }
    return true;
}

// Largest violation of the optimality conditions, each as the move it asks for.
double kkt_violation(const Problem& p, const std::vector<double>& w) {
    const test::ReferenceQp reference = p.reference();
    const std::vector<long double> g = reference.gradient(std::vector<long double>(w.begin(), w.end()));
    double worst = 0.0;
    for (std::size_t i = 0; i < p.n; ++i) {
        const double move = static_cast<double>(g[i]) / p.hessian[i * kMaxShapes + i];
        if (w[i] > p.low[i]) worst = std::max(worst, std::min(move, w[i] - p.low[i]));
        if (w[i] < p.high[i]) worst = std::max(worst, std::min(-move, p.high[i] - w[i]));
    }
    return worst;
}

TEST(BoxQp, TenThousandSmallProblemsAgainstEveryActiveSet) {
    test::SeededRandom random(101);
    for (int i = 0; i < 10'000; ++i) {
        const std::size_t n = 1 + random.below(i % 50 == 0 ? 8 : 5);
        const Problem p =
            random_problem(n, 1 + random.below(2 * n + 2), random.chance(0.5) ? 0.5 : 0.02, random);
        const Solved found = solve_cold(p);
        ASSERT_TRUE(found.report.optimal) << "case " << i;
        ASSERT_TRUE(feasible(p, found.w)) << "case " << i;
        const test::ReferenceQp reference = p.reference();
        const std::vector<long double> best = test::solve_exhaustively(reference);
        for (std::size_t k = 0; k < n; ++k) {
            ASSERT_NEAR(found.w[k], static_cast<double>(best[k]), 1e-7) << "case " << i << " weight " << k;
        }
        ASSERT_NEAR(found.report.objective, static_cast<double>(reference.objective(best)),
                    1e-10 * (1.0 + std::fabs(found.report.objective)));
        ASSERT_LT(found.report.kkt, 1e-8);
        ASSERT_LT(kkt_violation(p, found.w), 1e-8);
    }
}

TEST(BoxQp, LargeProblemsAgainstCoordinateDescent) {
    test::SeededRandom random(102);
    for (const std::size_t n : {20U, 53U, 120U}) {
        for (int i = 0; i < 4; ++i) {
            const Problem p = random_problem(n, 3 * n, 0.5, random);
            const Solved found = solve_cold(p);
            ASSERT_TRUE(found.report.optimal);
            const std::vector<long double> best = test::solve_by_descent(p.reference(), 1e-15L, 40'000);
            for (std::size_t k = 0; k < n; ++k) EXPECT_NEAR(found.w[k], static_cast<double>(best[k]), 1e-8);
            EXPECT_LT(kkt_violation(p, found.w), 1e-9);
        }
    }
}

TEST(BoxQp, LargestSizeEndsOptimal) {
    test::SeededRandom random(103);
    const Problem p = random_problem(kMaxShapes, 384, 0.01, random);
    const Solved found = solve_cold(p);
    EXPECT_TRUE(found.report.optimal);
    EXPECT_LT(kkt_violation(p, found.w), 1e-8);
    EXPECT_LT(found.report.iterations, 600);
}

TEST(BoxQp, WarmEqualsCold) {
    test::SeededRandom random(104);
    for (int i = 0; i < 300; ++i) {
        const std::size_t n = 2 + random.below(40);
        Problem p = random_problem(n, 2 * n, 0.05, random);
        BoxQpState state;
        std::vector<double> start(n);
        for (double& w : start) w = random.uniform(-1.0, 2.0);
        Solved previous = solve_from(p, state, start);
        for (double& q : p.linear) q += random.normal(0.0, 0.3);
        const Solved warm = solve_from(p, state, previous.w);
        const Solved cold = solve_cold(p);
        ASSERT_TRUE(warm.report.optimal && cold.report.optimal);
        for (std::size_t k = 0; k < n; ++k) ASSERT_NEAR(warm.w[k], cold.w[k], 1e-8) << "case " << i;
        const Solved again = solve_from(p, state, warm.w);
        ASSERT_LE(again.report.iterations, 2) << "the active set was right already";
    }
}

TEST(BoxQp, AnyWarmStateAndAnyStartLeadToTheSameAnswer) {
    test::SeededRandom random(105);
    for (int i = 0; i < 300; ++i) {
        const std::size_t n = 2 + random.below(20);
        const Problem p = random_problem(n, 2 * n, 0.05, random);
        BoxQpState state;
        state.warm = true;
        for (auto& where : state.where) where = static_cast<BoxQpState::Where>(random.below(3));
        std::vector<double> start(n);
        for (double& w : start)
            w = random.chance(0.2) ? std::numeric_limits<double>::quiet_NaN() : random.uniform(-1e6, 1e6);
        const Solved found = solve_from(p, state, start);
        const Solved cold = solve_cold(p);
        ASSERT_TRUE(found.report.optimal) << "case " << i;
        for (std::size_t k = 0; k < n; ++k) ASSERT_NEAR(found.w[k], cold.w[k], 1e-7) << "case " << i;
    }
}

TEST(BoxQp, CappedSolvesAreFeasibleAndNeverWorseThanTheirStart) {
    test::SeededRandom random(106);
    for (int i = 0; i < 300; ++i) {
        const std::size_t n = 10 + random.below(40);
        const Problem p = random_problem(n, 2 * n, 0.05, random);
        std::vector<double> start(n);
        for (std::size_t k = 0; k < n; ++k)
            start[k] = std::clamp(random.uniform(0.0, 1.0), p.low[k], p.high[k]);
        const test::ReferenceQp reference = p.reference();
        long double previous = reference.objective(std::vector<long double>(start.begin(), start.end()));
        for (const std::uint16_t cap : {0, 1, 2, 3, 5, 8}) {
            BoxQpConfig config;
            config.iteration_cap = cap;
            BoxQpState state;
            const Solved found = solve_from(p, state, start, config);
            ASSERT_TRUE(feasible(p, found.w));
            ASSERT_LE(found.report.iterations, cap);
            const long double value =
                reference.objective(std::vector<long double>(found.w.begin(), found.w.end()));
            ASSERT_LE(value, previous + 1e-9L)
                << "more iterations made it worse, case " << i << " cap " << cap;
            ASSERT_NEAR(found.report.objective, static_cast<double>(value),
                        1e-9 * (1.0 + std::fabs(found.report.objective)));
            previous = value;
            if (!found.report.optimal) {
                ASSERT_GT(found.report.kkt, 0.0);
            }
        }
    }
}

TEST(BoxQp, InfiniteBoundsGiveLeastSquares) {
    test::SeededRandom random(107);
    Problem p = random_problem(12, 30, 1e-6, random);
    p.low.assign(12, -kInfinity);
    p.high.assign(12, kInfinity);
    const Solved found = solve_cold(p);
    EXPECT_TRUE(found.report.optimal);
    EXPECT_EQ(found.report.iterations, 1);
    const test::ReferenceQp reference = p.reference();
    for (const long double g : reference.gradient(std::vector<long double>(found.w.begin(), found.w.end()))) {
        EXPECT_NEAR(static_cast<double>(g), 0.0, 1e-9);
    }
}

TEST(BoxQp, DuplicatedColumnsShareTheirWeight) {
    // Two equal shapes with a small ridge: the optimum is unique and gives each half.
    Problem p(2);
    for (std::size_t i = 0; i < 2; ++i) {
        for (std::size_t j = 0; j < 2; ++j) p.hessian[i * kMaxShapes + j] = 4.0 + (i == j ? 1e-6 : 0.0);
        p.linear[i] = -4.0 * 0.8;
        p.high[i] = 1.0;
    }
    const Solved found = solve_cold(p);
    EXPECT_TRUE(found.report.optimal);
    EXPECT_NEAR(found.w[0], 0.4, 1e-6);
    EXPECT_NEAR(found.w[1], 0.4, 1e-6);
}

TEST(BoxQp, MatrixThatIsNotPositiveDefiniteEndsFeasible) {
    for (const double diagonal : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
        Problem p(3);
        for (std::size_t i = 0; i < 3; ++i) {
            p.hessian[i * kMaxShapes + i] = diagonal;
            p.linear[i] = -1.0;
            p.high[i] = 1.0;
        }
        const Solved found = solve_cold(p);
        EXPECT_FALSE(found.report.optimal);
        EXPECT_TRUE(feasible(p, found.w));
    }
}

// Variable 0 starts at its bound and wants to leave the box: a step of length nothing. The others must not
// take that for leave to go on: an earlier version walked to the infinite bound of the next one.
TEST(BoxQp, StepOfNoLengthStopsEverybody) {
    Problem p(3);
    const double h[3][3] = {{1.0, 0.1, 0.0}, {0.1, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) p.hessian[i * kMaxShapes + j] = h[i][j];
    }
    p.linear = {1.0, -2.0, -0.5};
    p.low = {0.0, 0.0, 0.0};
    p.high = {1.0, kInfinity, 1.0};
    const Solved found = solve_cold(p);
    EXPECT_TRUE(found.report.optimal);
    EXPECT_NEAR(found.w[0], 0.0, 1e-15);
    EXPECT_NEAR(found.w[1], 2.0, 1e-15);
    EXPECT_NEAR(found.w[2], 0.5, 1e-15);
}

TEST(BoxQp, EmptyProblem) {
    const Solved found = solve_cold(Problem(0));
    EXPECT_TRUE(found.report.optimal);
    EXPECT_EQ(found.report.objective, 0.0);
}

}  // namespace
}  // namespace rig
