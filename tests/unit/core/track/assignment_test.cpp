#include "core/track/assignment.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <vector>

#include "tests/support/random.hpp"

namespace rig {
namespace {

struct Problem {
    std::size_t rows = 0;
    std::size_t columns = 0;
    std::vector<double> cost;
    double alone = 0.0;
};

std::vector<std::int16_t> solved(const Problem& p) {
    static const auto workspace = std::make_unique<AssignmentWorkspace>();
    AssignmentProblem problem;
    problem.row_count = p.rows;
    problem.column_count = p.columns;
    problem.cost = p.cost;
    problem.alone_cost = p.alone;
    std::vector<std::int16_t> column_of(p.rows, 77);
    solve_assignment(problem, *workspace, column_of);
    return column_of;
}

double total(const Problem& p, const std::vector<std::int16_t>& column_of) {
    double sum = 0.0;
    for (std::size_t r = 0; r < p.rows; ++r) {
        sum += column_of[r] < 0 ? p.alone : p.cost[r * p.columns + static_cast<std::size_t>(column_of[r])];
    }
    return sum;
}

bool valid(const Problem& p, const std::vector<std::int16_t>& column_of) {
    std::vector<bool> used(p.columns, false);
    for (std::size_t r = 0; r < p.rows; ++r) {
        if (column_of[r] < 0) {
            if (column_of[r] != -1) return false;
            continue;
        }
        const auto c = static_cast<std::size_t>(column_of[r]);
        if (c >= p.columns || used[c] || !(p.cost[r * p.columns + c] < p.alone)) return false;
        used[c] = true;
    }
    return true;
}

// Every way of giving rows their own columns or leaving them alone.
double brute_force(const Problem& p, std::size_t row, std::vector<bool>& used) {
    if (row == p.rows) return 0.0;
    double best = p.alone + brute_force(p, row + 1, used);
    for (std::size_t c = 0; c < p.columns; ++c) {
        const double cost = p.cost[row * p.columns + c];
        if (used[c] || !(cost < p.alone)) continue;
        used[c] = true;
        best = std::min(best, cost + brute_force(p, row + 1, used));
        used[c] = false;
    }
    return best;
}

TEST(Assignment, EqualsBruteForce) {
    test::SeededRandom random(61);
    for (int i = 0; i < 4000; ++i) {
        Problem p;
        p.rows = random.below(7);
        p.columns = random.below(7);
        const bool coarse = random.chance(0.5);  // small whole numbers: many ties
        p.alone = coarse ? static_cast<double>(1 + random.below(6)) : random.uniform(0.1, 1.2);
        for (std::size_t e = 0; e < p.rows * p.columns; ++e) {
            p.cost.push_back(coarse ? static_cast<double>(random.below(6)) : random.uniform(0.0, 1.0));
        }
        const std::vector<std::int16_t> found = solved(p);
        ASSERT_TRUE(valid(p, found)) << "case " << i;
        std::vector<bool> used(p.columns, false);
        ASSERT_NEAR(total(p, found), brute_force(p, 0, used), 1e-12) << "case " << i;
    }
}

TEST(Assignment, GateIsExclusive) {
    EXPECT_EQ(solved({1, 1, {0.999}, 1.0})[0], 0);
    EXPECT_EQ(solved({1, 1, {1.0}, 1.0})[0], -1) << "at the price of staying alone";
    EXPECT_EQ(solved({1, 1, {1.001}, 1.0})[0], -1);
}

TEST(Assignment, TakesTheLesserEvilForAll) {
    // Greedy would give row 0 its best column and leave row 1 alone.
    const Problem p{2, 2, {1.0, 2.0, 1.5, 50.0}, 10.0};
    EXPECT_EQ(solved(p), (std::vector<std::int16_t>{1, 0}));
}

TEST(Assignment, NoColumnsOrNoRows) {
    EXPECT_EQ(solved({3, 0, {}, 1.0}), (std::vector<std::int16_t>{-1, -1, -1}));
    EXPECT_TRUE(solved({0, 5, {}, 1.0}).empty());
}

TEST(Assignment, CostsThatAreNotNumbersAreNeverChosen) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinity = std::numeric_limits<double>::infinity();
    const Problem p{2, 3, {nan, infinity, 0.5, nan, nan, nan}, 1.0};
    EXPECT_EQ(solved(p), (std::vector<std::int16_t>{2, -1}));
}

TEST(Assignment, TinyNegativeCostsOfCancelledSquaresAreHarmless) {
    const Problem p{2, 2, {-1e-12, 0.3, 0.2, -1e-12}, 1.0};
    EXPECT_EQ(solved(p), (std::vector<std::int16_t>{0, 1}));
}

// The largest problem, built so that every new row displaces all rows before it: c(r, c) = (r + 1)(c + 1).
TEST(Assignment, WorstCaseOfTheLargestSizeEnds) {
    Problem p;
    p.rows = kMaxAssignmentRows;
    p.columns = kMaxAssignmentColumns;
    p.alone = 1e9;
    for (std::size_t r = 0; r < p.rows; ++r) {
        for (std::size_t c = 0; c < p.columns; ++c) p.cost.push_back(static_cast<double>((r + 1) * (c + 1)));
    }
    const std::vector<std::int16_t> found = solved(p);
    ASSERT_TRUE(valid(p, found));
    // By the rearrangement inequality the largest row takes the smallest column.
    for (std::size_t r = 0; r < p.rows; ++r) {
        EXPECT_EQ(found[r], static_cast<std::int16_t>(p.rows - 1 - r));
    }
}

TEST(Assignment, FindsAPermutationHiddenInALargeProblem) {
    test::SeededRandom random(62);
    Problem p;
    p.rows = kMaxAssignmentRows;
    p.columns = kMaxAssignmentColumns;
    p.alone = 100.0;
    std::vector<std::int16_t> truth(p.columns);
    for (std::size_t c = 0; c < p.columns; ++c) truth[c] = static_cast<std::int16_t>(c);
    random.shuffle(std::span<std::int16_t>(truth));
    for (std::size_t r = 0; r < p.rows; ++r) {
        for (std::size_t c = 0; c < p.columns; ++c) {
            const bool own = truth[r] == static_cast<std::int16_t>(c);
            p.cost.push_back(own ? random.uniform(0.0, 0.5) : random.uniform(0.6, 90.0));
        }
    }
    const std::vector<std::int16_t> found = solved(p);
    for (std::size_t r = 0; r < p.rows; ++r) EXPECT_EQ(found[r], truth[r]);
}

}  // namespace
}  // namespace rig
