#include "core/solve/simplex_walk.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/base/float_kernels.hpp"
#include "tests/support/simplex_problem.hpp"

namespace rig {
namespace {

using test::SeededRandom;
using test::SimplexProblem;

struct Walked {
    std::vector<float> c;
    std::uint32_t used = 1;
    SimplexWalkReport report;
};

Walked walk_from(const SimplexProblem& p, std::vector<float> c, std::uint32_t used, double tolerance = 1e-9,
                 std::uint16_t cap = 256) {
    const SimplexQpProblem view = p.view();
    SimplexWalkProblem problem;
    problem.rows = view.rows;
    problem.count = view.count;
    problem.stride = view.stride;
    problem.examples = view.examples;
    problem.target = view.target;
    problem.row_weight = view.row_weight;
    SimplexWalkState state;
    static SimplexWalkWorkspace workspace;
    Walked out{std::move(c), used, {}};
    out.report = walk_simplex(problem, tolerance, cap, state, workspace, out.used, out.c);
    return out;
}

Walked walk(const SimplexProblem& p, double tolerance = 1e-9, std::uint16_t cap = 256) {
    std::vector<float> first(p.count(), 0.0F);
    first[0] = 1.0F;
    return walk_from(p, first, 1, tolerance, cap);
}

std::vector<double> random_position(const std::vector<double>& raw, std::size_t rows, std::size_t count,
                                    double noise, SeededRandom& random) {
    std::vector<double> out(rows, 0.0);
    for (std::size_t r = 0; r < rows; ++r) {
        for (std::size_t i = 0; i < count; ++i) out[r] += raw[r * count + i] / static_cast<double>(count);
        out[r] += random.normal(0.0, noise);
    }
    return out;
}

TEST(SimplexWalk, EqualsTheExhaustiveReference) {
    SeededRandom random(1);
    for (int round = 0; round < 200; ++round) {
        const std::size_t count = 2 + random.below(7);
        const std::vector<double> raw = test::simplex_examples({.rows = 30, .count = count}, random);
        SimplexProblem p(30, count, raw);
        p.measure(random_position(raw, 30, count, 4.0, random));
        const Walked w = walk(p);
        ASSERT_TRUE(w.report.optimal);
        const std::vector<long double> best = test::solve_exhaustively(p.reference());
        for (std::size_t i = 0; i < count; ++i) {
            ASSERT_NEAR(w.c[i], static_cast<double>(best[i]), 1e-6) << round;
            EXPECT_EQ(w.c[i] > 0.0F, (w.used >> i & 1U) != 0);
        }
    }
}

// Duplicates, affine combinations and fewer rows than examples: certified, and as good as the reference.
TEST(SimplexWalk, DependentExamplesEndCertified) {
    SeededRandom random(2);
    for (int round = 0; round < 300; ++round) {
        test::SimplexFaceOptions o;
        o.rows = 3 + random.below(10);
        o.count = 2 + random.below(14);
        o.duplicates = random.below(3);
        o.affine = random.below(3);
        const std::vector<double> raw = test::simplex_examples(o, random);
        SimplexProblem p(o.rows, o.count, raw);
        p.measure(random_position(raw, o.rows, o.count, std::pow(10.0, random.uniform(-3.0, 1.5)), random));
        const Walked w = walk(p);
        ASSERT_TRUE(w.report.optimal) << round << " kkt " << w.report.kkt;
        const test::ReferenceSimplexQp reference = p.reference();
        const auto best = test::solve_by_pairs(reference, 1e-9L, 20000);
        const std::vector<long double> got(w.c.begin(), w.c.end());
        const long double scale =
            1e-6L * (1.0L + reference.objective(std::vector<long double>(o.count, 0.0L)));
        ASSERT_LE(reference.objective(got) - reference.objective(best), scale) << round;
    }
}

TEST(SimplexWalk, TwoEqualExamplesShare) {
    SimplexProblem p(3, 3, {0, 6, 6, 0, 0, 0, 0, 0, 0});
    p.measure({3, 0, 0});
    const Walked w = walk(p);
    EXPECT_TRUE(w.report.optimal);
    EXPECT_NEAR(w.c[0], 0.5, 1e-6);
    EXPECT_NEAR(w.c[1] + w.c[2], 0.5F, 1e-6);
}

TEST(SimplexWalk, EveryStopIsFeasibleAndNoWorse) {
    SeededRandom random(3);
    const std::vector<double> raw = test::simplex_examples({.similarity = 0.9}, random);
    SimplexProblem p(60, 12, raw);
    p.measure(random_position(raw, 60, 12, 1.0, random));
    double before = HUGE_VAL;
    for (std::uint16_t cap = 1; cap < 40; ++cap) {
        const Walked w = walk(p, 1e-9, cap);
        double sum = 0.0;
        for (const float c : w.c) {
            ASSERT_GE(c, 0.0F);
            sum += static_cast<double>(c);
        }
        EXPECT_NEAR(sum, 1.0, 1e-6);
        EXPECT_LE(w.report.objective, before + 1e-9 * std::fabs(before));
        EXPECT_LE(w.report.iterations, cap);
        before = w.report.objective;
    }
    EXPECT_FALSE(walk(p, 1e-9, 2).report.optimal);
    EXPECT_TRUE(walk(p).report.optimal);
}

TEST(SimplexWalk, ItsStartDoesNotMatter) {
    SeededRandom random(4);
    const std::vector<double> raw = test::simplex_examples({}, random);
    SimplexProblem p(60, 12, raw);
    p.measure(random_position(raw, 60, 12, 3.0, random));
    const Walked a = walk(p);
    const Walked b = walk_from(p, std::vector<float>(12, 1.0F / 12.0F), 0xfff);
    for (std::size_t i = 0; i < 12; ++i) EXPECT_NEAR(a.c[i], b.c[i], 1e-6);
}

}  // namespace
}  // namespace rig
