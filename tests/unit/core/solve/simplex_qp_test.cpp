#include "core/solve/simplex_qp.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/simplex_problem.hpp"

namespace rig {
namespace {

using test::SeededRandom;
using test::SimplexProblem;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Solved {
    std::vector<float> c;
    SimplexQpReport report;
};

Solved solve_from(const SimplexProblem& p, SimplexQpState& state, const SimplexQpConfig& config = {}) {
    static SimplexQpWorkspace workspace;
    Solved out{std::vector<float>(p.count(), -1.0F), {}};
    out.report = solve_simplex_qp(p.view(), config, state, workspace, out.c);
    return out;
}

Solved solve_cold(const SimplexProblem& p, const SimplexQpConfig& config = {}) {
    SimplexQpState state;
    return solve_from(p, state, config);
}

void expect_feasible(const std::vector<float>& c) {
    double sum = 0.0;
    for (const float x : c) {
        ASSERT_TRUE(x >= 0.0F && x <= 1.0001F) << x;
        sum += static_cast<double>(x);
    }
    ASSERT_NEAR(sum, 1.0, 1e-6);
}

std::vector<double> mix(const std::vector<double>& raw, std::size_t rows, const std::vector<double>& c) {
    std::vector<double> out(rows, 0.0);
    for (std::size_t r = 0; r < rows; ++r) {
        for (std::size_t i = 0; i < c.size(); ++i) out[r] += raw[r * c.size() + i] * c[i];
    }
    return out;
}

TEST(SimplexQp, ProjectsOntoATriangle) {
    // Three examples in the plane: (0,0), (4,0), (0,4), far from the origin of the coordinates.
    SimplexProblem p(2, 3, {100, 104, 100, 50, 50, 54});
    const auto at = [&](double x, double y) {
        p.measure({100.0 + x, 50.0 + y});
        const Solved s = solve_cold(p);
        EXPECT_TRUE(s.report.optimal);
        expect_feasible(s.c);
        return s.c;
    };
    std::vector<float> c = at(1, 1);  // inside
    EXPECT_NEAR(c[0], 0.5, 1e-6);
    EXPECT_NEAR(c[1], 0.25, 1e-6);
    EXPECT_NEAR(c[2], 0.25, 1e-6);
    c = at(1, -3);  // nearest is (1, 0)
    EXPECT_NEAR(c[0], 0.75, 1e-6);
    EXPECT_NEAR(c[1], 0.25, 1e-6);
    EXPECT_EQ(c[2], 0.0F);
    c = at(4, 4);  // the middle of the far edge
    EXPECT_EQ(c[0], 0.0F);
    EXPECT_NEAR(c[1], 0.5, 1e-6);
    c = at(-5, -5);  // a corner
    EXPECT_EQ(c[0], 1.0F);
}

TEST(SimplexQp, RecoversTheCombinationThatWasMade) {
    SeededRandom random(3);
    const std::vector<double> raw = test::simplex_examples({}, random);
    SimplexProblem p(60, 12, raw);
    std::vector<double> truth{0.1, 0.0, 0.4, 0.0, 0.0, 0.2, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0};
    p.measure(mix(raw, 60, truth));
    const Solved s = solve_cold(p);
    EXPECT_TRUE(s.report.optimal);
    for (std::size_t i = 0; i < 12; ++i) EXPECT_NEAR(s.c[i], truth[i], 2e-6);
}

// The positions are 60 mm from the origin and the examples move by a hundredth of that: without taking the
// mean out, float's Gram matrix would leave nothing of the differences.
TEST(SimplexQp, SmallMotionsFarFromTheOriginAreFound) {
    SeededRandom random(4);
    test::SimplexFaceOptions options;
    options.neutral_mm = 600.0;
    options.motion_mm = 0.6;
    const std::vector<double> raw = test::simplex_examples(options, random);
    SimplexProblem p(60, 12, raw);
    const std::vector<double> truth{0, 0.25, 0, 0.25, 0, 0, 0.25, 0, 0, 0.25, 0, 0};
    p.measure(mix(raw, 60, truth));
    const Solved s = solve_cold(p);
    for (std::size_t i = 0; i < 12; ++i) EXPECT_NEAR(s.c[i], truth[i], 2e-6);
}

TEST(SimplexQp, WarmAndColdStartAgree) {
    SeededRandom random(5);
    const std::vector<double> raw = test::simplex_examples({}, random);
    SimplexProblem p(60, 12, raw);
    const test::SimplexTrajectory trajectory(12, random);
    SimplexQpState warm;
    int changes_warm = 0;
    int changes_cold = 0;
    for (int frame = 0; frame < 400; ++frame) {
        std::vector<double> position = mix(raw, 60, trajectory.at(frame));
        for (double& x : position) x += random.normal(0.0, 0.3);
        p.measure(position);
        SimplexQpConfig sharp;  // so that what differs is the way and not the tolerance
        sharp.tolerance = 5e-7F;
        const Solved a = solve_from(p, warm, sharp);
        const Solved b = solve_cold(p, sharp);
        ASSERT_TRUE(a.report.optimal && b.report.optimal) << frame;
        for (std::size_t i = 0; i < 12; ++i) ASSERT_NEAR(a.c[i], b.c[i], 2e-5) << frame;
        changes_warm += a.report.changes;
        changes_cold += b.report.changes;
    }
    EXPECT_LT(changes_warm, changes_cold);
}

TEST(SimplexQp, HiddenRowsAreAsIfTheyWereNotThere) {
    SeededRandom random(6);
    const std::vector<double> raw = test::simplex_examples({}, random);
    SimplexProblem p(60, 12, raw);
    std::vector<double> position = mix(raw, 60, {0.2, 0.3, 0.5, 0, 0, 0, 0, 0, 0, 0, 0, 0});
    for (double& x : position) x += random.normal(0.0, 1.0);
    std::vector<double> with_nan = position;
    std::vector<float> weight(60, 1.0F);
    for (const std::size_t r : {0U, 1U, 2U, 30U, 59U}) {
        with_nan[r] = kNan;
        weight[r] = 0.0F;
    }
    p.measure(with_nan);
    const Solved a = solve_cold(p);
    p.measure(position);
    p.weigh(weight);
    const Solved b = solve_cold(p);
    EXPECT_EQ(a.report.rows_used, 55);
    EXPECT_EQ(b.report.rows_used, 55);
    EXPECT_EQ(a.c, b.c);
    p.weigh({});
    const Solved whole = solve_cold(p);
    EXPECT_EQ(whole.report.rows_used, 60);
    EXPECT_NE(a.c, whole.c);
}

TEST(SimplexQp, WeightsThatChangeFromFrameToFrameAreTakenUp) {
    SeededRandom random(7);
    const std::vector<double> raw = test::simplex_examples({}, random);
    SimplexProblem p(60, 12, raw);
    SimplexQpState warm;
    std::vector<double> position = mix(raw, 60, {0.2, 0, 0, 0.3, 0, 0, 0, 0, 0.5, 0, 0, 0});
    for (double& x : position) x += random.normal(0.0, 1.0);
    p.measure(position);
    for (int frame = 0; frame < 60; ++frame) {
        std::vector<float> weight(60);
        for (float& x : weight) x = random.chance(0.2) ? 0.0F : static_cast<float>(random.uniform(0.1, 2.0));
        p.weigh(frame % 7 == 0 ? std::vector<float>{} : weight);
        const Solved a = solve_from(p, warm);
        const Solved b = solve_cold(p);
        ASSERT_TRUE(a.report.optimal);
        for (std::size_t i = 0; i < 12; ++i) ASSERT_NEAR(a.c[i], b.c[i], 2e-5) << frame;
    }
}

TEST(SimplexQp, NothingSeenKeepsTheLastAnswer) {
    SeededRandom random(8);
    const std::vector<double> raw = test::simplex_examples({.rows = 30, .count = 5}, random);
    SimplexProblem p(30, 5, raw);
    const std::vector<double> nothing(30, kNan);
    p.measure(nothing);
    SimplexQpState state;
    const Solved first = solve_from(p, state);
    for (const float c : first.c) EXPECT_EQ(c, 0.2F);  // no last answer: the mean of the examples
    p.measure(mix(raw, 30, {0, 0.6, 0, 0.4, 0}));
    const Solved seen = solve_from(p, state);
    EXPECT_NEAR(seen.c[1], 0.6, 1e-6);
    p.measure(nothing);
    for (int i = 0; i < 3; ++i) {
        const Solved hidden = solve_from(p, state);
        EXPECT_EQ(hidden.c, seen.c);
        EXPECT_EQ(hidden.report.rows_used, 0);
    }
    p.measure(mix(raw, 30, {1, 0, 0, 0, 0}));
    EXPECT_NEAR(solve_from(p, state).c[0], 1.0, 1e-6);
}

TEST(SimplexQp, OneExampleIsTheAnswer) {
    SimplexProblem p(6, 1, {1, 2, 3, 4, 5, 6});
    p.measure({9, 9, 9, 9, 9, 9});
    const Solved s = solve_cold(p);
    EXPECT_EQ(s.c[0], 1.0F);
    EXPECT_TRUE(s.report.optimal);
}

TEST(SimplexQp, EqualExamplesShareWithoutHarm) {
    SimplexProblem p(3, 4, {1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3});
    p.measure({5, 5, 5});
    const Solved s = solve_cold(p);
    expect_feasible(s.c);
    EXPECT_TRUE(s.report.optimal);
}

TEST(SimplexQp, StoppedEarlyItIsFeasibleAndSaysSo) {
    SeededRandom random(9);
    const std::vector<double> raw = test::simplex_examples({.similarity = 0.2}, random);
    SimplexProblem p(60, 12, raw);
    p.measure(mix(raw, 60, std::vector<double>(12, 1.0 / 12)));
    float last = std::numeric_limits<float>::infinity();
    for (std::uint16_t cap = 1; cap < 20; ++cap) {
        SimplexQpConfig config;
        config.iteration_cap = cap;
        const Solved s = solve_cold(p, config);
        expect_feasible(s.c);
        EXPECT_LE(s.report.iterations, cap);
        EXPECT_LE(s.report.objective, last + 1e-3F * std::fabs(last));
        EXPECT_GE(s.report.gap, 0.0F);
        if (cap == 1) {
            EXPECT_FALSE(s.report.optimal);
        }
        last = s.report.objective;
    }
    EXPECT_TRUE(solve_cold(p).report.optimal);
}

TEST(SimplexQp, AStateOfAnotherProblemIsNotBelieved) {
    SeededRandom random(10);
    const std::vector<double> raw = test::simplex_examples({}, random);
    SimplexProblem a(60, 12, raw);
    SimplexProblem b(30, 5, test::simplex_examples({.rows = 30, .count = 5}, random));
    a.measure(mix(raw, 60, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.5, 0.5}));
    b.measure(std::vector<double>(30, 1.0));
    SimplexQpState state;
    static_cast<void>(solve_from(a, state));
    const Solved after = solve_from(b, state);
    EXPECT_EQ(after.c, solve_cold(b).c);
}

// The digits of a fixed sequence, so that a change of the arithmetic on any machine shows.
TEST(SimplexQp, TheSameBitsEverywhere) {
    SeededRandom random(11);
    const std::vector<double> raw = test::simplex_examples({}, random);
    SimplexProblem p(60, 12, raw);
    const std::vector<double> middle(12, 0.0625);
    SimplexQpState state;
    std::uint64_t digest = 14695981039346656037ULL;
    for (int frame = 0; frame < 200; ++frame) {
        std::vector<double> position = mix(raw, 60, middle);
        for (double& x : position) x = std::floor((x + random.uniform(-1.0, 1.0)) * 1024.0) / 1024.0;
        p.measure(position);
        for (const float c : solve_from(p, state).c)
            digest = (digest ^ std::bit_cast<std::uint32_t>(c)) * 1099511628211ULL;
    }
    RecordProperty("digest", std::to_string(digest));
    EXPECT_EQ(digest, 6976489536086184209ULL);
}

}  // namespace
}  // namespace rig
