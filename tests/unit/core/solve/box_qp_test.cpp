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

constexpr std::size_t kStride = row_stride(kMaxUnknowns);
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A problem in double; solved in either precision.
struct Problem {
    explicit Problem(std::size_t size)
        : n(size), hessian(size * kStride, 0.0), linear(size), low(size), high(size) {}

    [[nodiscard]] test::ReferenceQp reference() const {
        test::ReferenceQp r;
        r.size = n;
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = 0; j < n; ++j)
                r.hessian.push_back(static_cast<long double>(hessian[i * kStride + j]));
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

template <typename Real>
class BoxQp : public testing::Test {
  public:
    static constexpr bool kSingle = sizeof(Real) == sizeof(float);
    // What rounding leaves of weights and of multipliers (as moves); float's problems are well posed.
    static constexpr double kWeight = kSingle ? 2e-4 : 1e-7;
    static constexpr double kMove = kSingle ? 1e-5 : 1e-8;

    struct Solved {
        std::vector<double> w;
        BoxQpReport report;
    };

    static BoxQpConfig tight() { return {.tolerance = kSingle ? 1e-6 : 1e-10}; }

    static Solved solve_from(const Problem& p, BoxQpState<Real>& state, const std::vector<double>& start,
                             const BoxQpConfig& config = tight()) {
        static const auto workspace = std::make_unique<BoxQpWorkspace<Real>>();
        const auto in = [](const std::vector<double>& v) { return std::vector<Real>(v.begin(), v.end()); };
        static std::uint32_t version = 0;
        const std::vector<Real> h = in(p.hessian), q = in(p.linear), low = in(p.low), high = in(p.high);
        std::vector<Real> w = in(start);
        const BoxQpProblem<Real> problem{p.n, kStride, h, q, low, high, ++version};
        const BoxQpReport report = solve_box_qp(problem, config, state, *workspace, std::span<Real>(w));
        return {std::vector<double>(w.begin(), w.end()), report};
    }

    static Solved solve_cold(const Problem& p, const BoxQpConfig& config = tight()) {
        static const auto state = std::make_unique<BoxQpState<Real>>();
        state->warm = false;
        return solve_from(p, *state, std::vector<double>(p.n, 0.0), config);
    }

    static bool feasible(const Problem& p, const std::vector<double>& w) {
        for (std::size_t i = 0; i < p.n; ++i) {
            if (!(w[i] >= static_cast<double>(static_cast<Real>(p.low[i])) &&
                  w[i] <= static_cast<double>(static_cast<Real>(p.high[i])))) {
                return false;
            }
        }
        return true;
    }
};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(BoxQp, Precisions);

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
            for (std::size_t r = 0; r < rows; ++r) p.hessian[i * kStride + j] += b[r * n + i] * b[r * n + j];
        }
        p.hessian[i * kStride + i] += ridge;
    }
    std::vector<double> target(n);
    for (double& t : target) t = random.uniform(-0.6, 1.6);
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < n; ++j) p.linear[i] -= p.hessian[i * kStride + j] * target[j];
        p.linear[i] += random.normal(0.0, 0.2);
        const double kind = random.uniform(0.0, 1.0);
        p.low[i] = kind < 0.1 ? -kInfinity : (kind < 0.2 ? -0.5 : 0.0);
        p.high[i] = random.chance(0.1) ? kInfinity : 1.0;
        if (random.chance(0.05) && std::isfinite(p.low[i])) p.high[i] = p.low[i];
    }
    for (double& h : p.hessian) h = static_cast<double>(static_cast<float>(h));  // the same problem for both
    for (double& q : p.linear) q = static_cast<double>(static_cast<float>(q));
    return p;
}

// Largest violation of the optimality conditions, each as the move it asks for.
double kkt_violation(const Problem& p, const std::vector<double>& w) {
    const test::ReferenceQp reference = p.reference();
    const std::vector<long double> g = reference.gradient(std::vector<long double>(w.begin(), w.end()));
    double worst = 0.0;
    for (std::size_t i = 0; i < p.n; ++i) {
        const double move = static_cast<double>(g[i]) / p.hessian[i * kStride + i];
        if (w[i] > p.low[i]) worst = std::max(worst, std::min(move, w[i] - p.low[i]));
        if (w[i] < p.high[i]) worst = std::max(worst, std::min(-move, p.high[i] - w[i]));
    }
    return worst;
}

TYPED_TEST(BoxQp, TenThousandSmallProblemsAgainstEveryActiveSet) {
    test::SeededRandom random(101);
    for (int i = 0; i < 10'000; ++i) {
        const std::size_t n = 1 + random.below(i % 50 == 0 ? 8 : 5);
        const Problem p =
            random_problem(n, 1 + random.below(2 * n + 2), random.chance(0.5) ? 0.5 : 0.02, random);
        const auto found = this->solve_cold(p);
        ASSERT_TRUE(found.report.optimal) << "case " << i;
        ASSERT_TRUE(this->feasible(p, found.w)) << "case " << i;
        const test::ReferenceQp reference = p.reference();
        const std::vector<long double> best = test::solve_exhaustively(reference);
        for (std::size_t k = 0; k < n; ++k) {
            ASSERT_NEAR(found.w[k], static_cast<double>(best[k]),
                        this->kWeight * (1.0 + std::fabs(found.w[k])))
                << "case " << i << " weight " << k;
        }
        ASSERT_NEAR(found.report.objective, static_cast<double>(reference.objective(best)),
                    this->kMove * (1.0 + std::fabs(found.report.objective)));
        ASSERT_LT(found.report.kkt, this->kMove);
        ASSERT_LT(kkt_violation(p, found.w), this->kMove);
    }
}

TYPED_TEST(BoxQp, LargeProblemsAgainstCoordinateDescent) {
    test::SeededRandom random(102);
    for (const std::size_t n : {20U, 53U, 120U}) {
        for (int i = 0; i < 4; ++i) {
            const Problem p = random_problem(n, 3 * n, 0.5, random);
            const auto found = this->solve_cold(p);
            ASSERT_TRUE(found.report.optimal);
            const std::vector<long double> best = test::solve_by_descent(p.reference(), 1e-15L, 40'000);
            for (std::size_t k = 0; k < n; ++k)
                EXPECT_NEAR(found.w[k], static_cast<double>(best[k]), this->kWeight);
            EXPECT_LT(kkt_violation(p, found.w), this->kMove);
        }
    }
}

TYPED_TEST(BoxQp, LargestSizeEndsOptimal) {
    test::SeededRandom random(103);
    const Problem p = random_problem(kMaxUnknowns, 384, 0.01, random);
    const auto found = this->solve_cold(p);
    EXPECT_TRUE(found.report.optimal);
    EXPECT_LT(kkt_violation(p, found.w), this->kMove);
    EXPECT_LT(found.report.iterations, 600);
}

TYPED_TEST(BoxQp, WarmEqualsCold) {
    test::SeededRandom random(104);
    for (int i = 0; i < 300; ++i) {
        const std::size_t n = 2 + random.below(40);
        Problem p = random_problem(n, 2 * n, 0.05, random);
        BoxQpState<TypeParam> state;
        std::vector<double> start(n);
        for (double& w : start) w = random.uniform(-1.0, 2.0);
        auto previous = this->solve_from(p, state, start);
        for (double& q : p.linear) q += random.normal(0.0, 0.3);
        const auto warm = this->solve_from(p, state, previous.w);
        const auto cold = this->solve_cold(p);
        ASSERT_TRUE(warm.report.optimal && cold.report.optimal);
        for (std::size_t k = 0; k < n; ++k) ASSERT_NEAR(warm.w[k], cold.w[k], this->kWeight) << "case " << i;
        const auto again = this->solve_from(p, state, warm.w);
        ASSERT_LE(again.report.iterations, 2) << "the active set was right already";
    }
}

TYPED_TEST(BoxQp, AnyWarmStateAndAnyStartLeadToTheSameAnswer) {
    test::SeededRandom random(105);
    for (int i = 0; i < 300; ++i) {
        const std::size_t n = 2 + random.below(20);
        const Problem p = random_problem(n, 2 * n, 0.05, random);
        BoxQpState<TypeParam> state;
        state.warm = true;
        for (auto& where : state.where)
            where = static_cast<typename BoxQpState<TypeParam>::Where>(random.below(3));
        std::vector<double> start(n);
        for (double& w : start)
            w = random.chance(0.2) ? std::numeric_limits<double>::quiet_NaN() : random.uniform(-1e6, 1e6);
        const auto found = this->solve_from(p, state, start);
        const auto cold = this->solve_cold(p);
        ASSERT_TRUE(found.report.optimal) << "case " << i;
        for (std::size_t k = 0; k < n; ++k) ASSERT_NEAR(found.w[k], cold.w[k], this->kWeight) << "case " << i;
    }
}

TYPED_TEST(BoxQp, CappedSolvesAreFeasibleAndNeverWorseThanTheirStart) {
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
            BoxQpState<TypeParam> state;
            const auto found = this->solve_from(p, state, start, config);
            ASSERT_TRUE(this->feasible(p, found.w));
            ASSERT_LE(found.report.iterations, cap);
            const long double value =
                reference.objective(std::vector<long double>(found.w.begin(), found.w.end()));
            ASSERT_LE(value, previous + static_cast<long double>(this->kMove) * (1.0L + std::fabs(value)))
                << "more iterations made it worse, case " << i << " cap " << cap;
            ASSERT_NEAR(found.report.objective, static_cast<double>(value),
                        this->kMove * (1.0 + std::fabs(found.report.objective)));
            previous = value;
            if (!found.report.optimal) {
                ASSERT_GT(found.report.kkt, 0.0);
            }
        }
    }
}

TYPED_TEST(BoxQp, InfiniteBoundsGiveLeastSquares) {
    test::SeededRandom random(107);
    Problem p = random_problem(12, 30, this->kSingle ? 0.02 : 1e-6, random);
    p.low.assign(12, -kInfinity);
    p.high.assign(12, kInfinity);
    const auto found = this->solve_cold(p);
    EXPECT_TRUE(found.report.optimal);
    EXPECT_LE(found.report.iterations, 3);
    const test::ReferenceQp reference = p.reference();
    for (const long double g : reference.gradient(std::vector<long double>(found.w.begin(), found.w.end()))) {
        EXPECT_NEAR(static_cast<double>(g), 0.0, 100.0 * this->kMove);
    }
}

TYPED_TEST(BoxQp, DuplicatedColumnsShareTheirWeight) {
    // Two equal shapes with a small ridge: the optimum is unique and gives each half.
    Problem p(2);
    for (std::size_t i = 0; i < 2; ++i) {
        for (std::size_t j = 0; j < 2; ++j) p.hessian[i * kStride + j] = 4.0 + (i == j ? 1e-3 : 0.0);
        p.linear[i] = -4.0 * 0.8;
        p.high[i] = 1.0;
    }
    const auto found = this->solve_cold(p);
    EXPECT_TRUE(found.report.optimal);
    EXPECT_NEAR(found.w[0], 0.4, 2e-4);
    EXPECT_NEAR(found.w[1], 0.4, 2e-4);
}

// Without curvature the slope decides: the variable slides to the bound it is pulled to.
TYPED_TEST(BoxQp, NoCurvatureSlidesToTheBound) {
    Problem p(3);
    p.linear = {-1.0, 1.0, -1.0};
    p.high = {1.0, 1.0, kInfinity};
    const auto found = this->solve_cold(p);
    EXPECT_EQ(found.w[0], 1.0);
    EXPECT_EQ(found.w[1], 0.0);
    EXPECT_TRUE(std::isfinite(found.w[2])) << "nothing bounds it: any finite answer, and the report says so";
    EXPECT_FALSE(found.report.optimal);
}

// Copies of one column without a ridge: the sum is what matters, and a bound that one meets the others take
// up.
TYPED_TEST(BoxQp, CopiesWithoutARidgeReachTheOptimalSum) {
    Problem p(3);
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) p.hessian[i * kStride + j] = 4.0;
        p.linear[i] = -4.0 * 1.75;
        p.high[i] = 1.0;
    }
    const auto found = this->solve_cold(p);
    EXPECT_TRUE(found.report.optimal);
    EXPECT_NEAR(found.w[0] + found.w[1] + found.w[2], 1.75, 1e-5);
    EXPECT_TRUE(this->feasible(p, found.w));
}

TYPED_TEST(BoxQp, NumbersThatAreNoneEndFeasibleAndSaySo) {
    Problem p(3);
    for (std::size_t i = 0; i < 3; ++i) {
        p.hessian[i * kStride + i] = i == 1 ? std::numeric_limits<double>::quiet_NaN() : 1.0;
        p.linear[i] = -0.5;
        p.high[i] = 1.0;
    }
    const auto found = this->solve_cold(p);
    EXPECT_FALSE(found.report.optimal);
    EXPECT_TRUE(this->feasible(p, found.w));
}

// Variable 0 starts at its bound and wants to leave the box: a step of length nothing. The others must not
// take that for leave to go on: an earlier version walked to the infinite bound of the next one.
TYPED_TEST(BoxQp, StepOfNoLengthStopsEverybody) {
    Problem p(3);
    const double h[3][3] = {{1.0, 0.1, 0.0}, {0.1, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) p.hessian[i * kStride + j] = h[i][j];
    }
    p.linear = {1.0, -2.0, -0.5};
    p.low = {0.0, 0.0, 0.0};
    p.high = {1.0, kInfinity, 1.0};
    const auto found = this->solve_cold(p);
    EXPECT_TRUE(found.report.optimal);
    EXPECT_EQ(found.w[0], 0.0);
    EXPECT_NEAR(found.w[1], 2.0, 1e-6);
    EXPECT_NEAR(found.w[2], 0.5, 1e-6);
}

TYPED_TEST(BoxQp, EmptyProblem) {
    const auto found = this->solve_cold(Problem(0));
    EXPECT_TRUE(found.report.optimal);
    EXPECT_EQ(found.report.objective, 0.0);
}

}  // namespace
}  // namespace rig
