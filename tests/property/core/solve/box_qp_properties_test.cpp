// Random and degenerate problems: every one ends inside its cap, finite and feasible, and those that say they
// are optimal are, by a long double reference. RIG_BOX_QP_PROBLEMS=1000000 makes as many of them as one
// likes.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "core/solve/box_qp.hpp"
#include "tests/support/random.hpp"

namespace rig {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kRows = 40;

// What H, q and the bounds were drawn from, in double; entries of B are of order 1.
struct Drawn {
    std::size_t n = 0;
    std::vector<double> h, q, low, high;
    bool sound = true;    // all numbers are numbers
    bool strict = false;  // a ridge makes H positive definite
};

std::vector<double> draw_basis(std::size_t n, std::size_t rows, test::SeededRandom& random) {
    std::vector<double> b(rows * n);
    for (double& x : b) x = random.normal(0.0, 1.0);
    const auto copy = [&](std::size_t from, std::size_t to, double factor) {
        for (std::size_t r = 0; r < rows; ++r) b[r * n + to] = factor * b[r * n + from];
    };
    for (std::size_t i = 1; i < n; ++i) {
        const double kind = random.uniform(0.0, 1.0);
        if (kind < 0.08) copy(random.below(i), i, 1.0);   // duplicated
        if (kind > 0.95) copy(random.below(i), i, -1.0);  // opposed
        if (kind > 0.5 && kind < 0.54) copy(0, i, 0.0);   // invisible
        if (kind > 0.6 && kind < 0.64 && i > 1) {         // dependent on two
            for (std::size_t r = 0; r < rows; ++r) b[r * n + i] = 0.5 * (b[r * n + i - 1] + b[r * n + i - 2]);
        }
    }
    if (random.chance(0.05)) std::fill(b.begin(), b.end(), 0.0);  // nothing is seen
    return b;
}

void draw_bounds(Drawn& d, test::SeededRandom& random) {
    for (std::size_t i = 0; i < d.n; ++i) {
        const double kind = random.uniform(0.0, 1.0);
        d.low.push_back(kind < 0.05 ? -kInfinity : (kind < 0.2 ? -0.5 : 0.0));
        d.high.push_back(random.chance(0.1) ? kInfinity : 1.0);
        if (random.chance(0.05) && std::isfinite(d.low[i])) d.high[i] = d.low[i];
    }
}

Drawn draw(test::SeededRandom& random) {
    Drawn d;
    d.n = 1 + random.below(random.chance(0.1) ? 24 : 8);
    const std::size_t rows = 1 + random.below(kRows);
    const std::vector<double> b = draw_basis(d.n, rows, random);
    d.strict = random.chance(0.5);
    const double ridge = d.strict ? 0.05 : 0.0;
    std::vector<double> t(rows);
    for (double& x : t) x = random.normal(0.0, 2.0);
    d.h.assign(d.n * d.n, 0.0);
    d.q.assign(d.n, random.chance(0.5) ? 0.01 : 0.0);  // sparsity
    for (std::size_t i = 0; i < d.n; ++i) {
        for (std::size_t r = 0; r < rows; ++r) {
            d.q[i] -= b[r * d.n + i] * t[r];
            for (std::size_t j = 0; j < d.n; ++j) d.h[i * d.n + j] += b[r * d.n + i] * b[r * d.n + j];
        }
        d.h[i * d.n + i] += ridge;
        d.q[i] -=
            d.strict && random.chance(0.2) ? ridge * random.uniform(-5.0, 5.0) : 0.0;  // a contrary prior
    }
    draw_bounds(d, random);
    if (random.chance(0.02)) {
        d.sound = false;
        const double bad = random.chance(0.5) ? std::numeric_limits<double>::quiet_NaN() : kInfinity;
        if (random.chance(0.5))
            d.q[random.below(d.n)] = bad;
        else
            d.h[random.below(d.n * d.n)] = bad;
    }
    return d;
}

// Largest violation of the optimality conditions, as a Jacobi move, in long double, beyond what rounding the
// terms of the gradient by `rounding` explains.
long double violation(const Drawn& d, const std::vector<double>& w, double rounding) {
    long double worst = 0.0L;
    for (std::size_t i = 0; i < d.n; ++i) {
        long double g = static_cast<long double>(d.q[i]);
        long double terms = std::fabs(g);
        for (std::size_t j = 0; j < d.n; ++j) {
            const long double term =
                static_cast<long double>(d.h[i * d.n + j]) * static_cast<long double>(w[j]);
            g += term;
            terms += std::fabs(term);
        }
        const auto diagonal = static_cast<long double>(std::max(d.h[i * d.n + i], 1e-9));
        const auto x = static_cast<long double>(w[i]);
        const long double target = std::fmin(std::fmax(x - g / diagonal, static_cast<long double>(d.low[i])),
                                             static_cast<long double>(d.high[i]));
        worst =
            std::fmax(worst, std::fabs(x - target) - static_cast<long double>(rounding) * terms / diagonal);
    }
    return worst;
}

std::size_t problems() {
    const char* text = std::getenv("RIG_BOX_QP_PROBLEMS");
    return text != nullptr ? static_cast<std::size_t>(std::stoul(text)) : 20'000;
}

template <typename Real>
class BoxQpProperties : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(BoxQpProperties, Precisions);

TYPED_TEST(BoxQpProperties, EveryProblemEndsFeasibleAndTheOptimalOnesAre) {
    using Real = TypeParam;
    constexpr bool kSingle = sizeof(Real) == sizeof(float);
    test::SeededRandom random(31);
    const auto state = std::make_unique<BoxQpState<Real>>();
    const auto workspace = std::make_unique<BoxQpWorkspace<Real>>();
    const BoxQpConfig config{.tolerance = kSingle ? 1e-6 : 1e-9};
    std::size_t optimal = 0, sound = 0, longest = 0;
    for (std::size_t trial = 0; trial < problems(); ++trial) {
        Drawn d = draw(random);
        const std::size_t stride = row_stride(d.n);
        std::vector<Real> h(d.n * stride, Real(0)), q(d.n), low(d.n), high(d.n), w(d.n);
        for (std::size_t i = 0; i < d.n; ++i) {
            for (std::size_t j = 0; j < d.n; ++j) h[i * stride + j] = static_cast<Real>(d.h[i * d.n + j]);
            for (std::size_t j = 0; j < d.n; ++j) d.h[i * d.n + j] = static_cast<double>(h[i * stride + j]);
            q[i] = static_cast<Real>(d.q[i]);
            d.q[i] = static_cast<double>(q[i]);
            low[i] = static_cast<Real>(d.low[i]);
            high[i] = static_cast<Real>(d.high[i]);
            w[i] = static_cast<Real>(random.uniform(-0.5, 1.5));
        }
        state->warm = random.chance(0.5) && state->warm;  // left over from another problem of the same size
        const BoxQpReport report =
            solve_box_qp({d.n, stride, h, q, low, high, static_cast<std::uint32_t>(trial)}, config, *state,
                         *workspace, std::span<Real>(w));
        ASSERT_LE(report.iterations, config.iteration_cap);
        longest = std::max(longest, static_cast<std::size_t>(report.iterations));
        std::vector<double> answer(d.n);
        for (std::size_t i = 0; i < d.n; ++i) {
            answer[i] = static_cast<double>(w[i]);
            ASSERT_TRUE(std::isfinite(answer[i])) << "problem " << trial;
            ASSERT_TRUE(w[i] >= low[i] && w[i] <= high[i]) << "problem " << trial;
        }
        if (!d.sound) continue;
        ++sound;
        if (!report.optimal) {
            ASSERT_FALSE(d.strict) << "problem " << trial << ": positive definite, and kkt " << report.kkt;
            continue;
        }
        ++optimal;
        double size = 1.0;
        for (const double x : answer) size = std::max(size, std::fabs(x));
        ASSERT_LE(static_cast<double>(
                      violation(d, answer, 4.0 * static_cast<double>(std::numeric_limits<Real>::epsilon()))),
                  (kSingle ? 1.1e-5 : 1.1e-8) * size)
            << "problem " << trial;
    }
    std::printf("%zu of %zu sound problems optimal, at most %zu iterations\n", optimal, sound, longest);
    EXPECT_GE(static_cast<double>(optimal), 0.97 * static_cast<double>(sound));
}

}  // namespace
}  // namespace rig
