#include "core/detect/bit_rows.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <vector>

#include "tests/support/random.hpp"

namespace {

using namespace rig;
using test::SeededRandom;

bool bit(const BitRows& rows, int x, int y) {
    return x >= 0 && x < 64 && y >= 0 && y < 64 && (rows[static_cast<std::size_t>(y)] >> x & 1U) != 0;
}

BitRows random_rows(SeededRandom& random, int width, int height, double density) {
    BitRows rows{};
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            if (random.chance(density)) rows[static_cast<std::size_t>(y)] |= std::uint64_t{1} << x;
        }
    }
    return rows;
}

TEST(BitRows, SpansAndMasks) {
    EXPECT_EQ(row_mask(0), 0U);
    EXPECT_EQ(row_mask(3), 7U);
    EXPECT_EQ(row_mask(64), ~std::uint64_t{0});
    EXPECT_EQ(bit_span(2, 5), 0b11100U);
    EXPECT_EQ(bit_span(0, 64), ~std::uint64_t{0});
}

TEST(BitRows, GrowingReachesExactlyTheNeighbours) {
    SeededRandom random(4);
    for (const int height : {1, 2, 17, 64}) {
        const BitRows before = random_rows(random, 64, height, 0.05);
        BitRows cross = before;
        BitRows square = before;
        grow_cross(cross, height);
        grow_square(square, height);
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < 64; ++x) {
                bool near = false;
                bool beside = false;
                for (int v = -1; v <= 1; ++v) {
                    for (int u = -1; u <= 1; ++u) {
                        near |= bit(before, x + u, y + v);
                        beside |= bit(before, x + u, y + v) && (u == 0 || v == 0);
                    }
                }
                ASSERT_EQ(bit(square, x, y), near);
                ASSERT_EQ(bit(cross, x, y), beside);
            }
        }
    }
}

BitRows octagon(BitRows rows, int height) {
    grow_square(rows, height);
    grow_cross(rows, height);
    return rows;
}

TEST(BitRows, SurroundingsAreOctagonsAroundTheSet) {
    SeededRandom random(7);
    for (int round = 0; round < 100; ++round) {
        const int width = 1 + static_cast<int>(random.below(64));
        const int height = 1 + static_cast<int>(random.below(64));
        const BitRows set = random_rows(random, width, height, 0.02);
        BitRows inner = set;
        grow_square(inner, height);
        const BitRows middle = octagon(inner, height);
        const BitRows outer = octagon(middle, height);
        BitRows moat{};
        BitRows ring{};
        BitRows moat_alone{};
        draw_surroundings(set, width, height, moat, ring);
        draw_moat(set, width, height, moat_alone);
        BitRows grown = set;
        grow_octagon(grown, height);
        for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
            ASSERT_EQ(moat[y], middle[y] & ~inner[y] & row_mask(width));
            ASSERT_EQ(moat_alone[y], moat[y]);
            ASSERT_EQ(ring[y], outer[y] & ~middle[y] & row_mask(width));
            ASSERT_EQ(grown[y], octagon(set, height)[y]);
        }
    }
}

TEST(BitRows, WhatTwoReachAtOnceGoesToTheFirst) {
    SeededRandom random(8);
    for (int round = 0; round < 100; ++round) {
        const int width = 1 + static_cast<int>(random.below(64));
        const int height = 1 + static_cast<int>(random.below(64));
        const int steps = static_cast<int>(random.below(9));
        BitRows own = random_rows(random, width, height, 0.01);
        BitRows others = random_rows(random, width, height, 0.01);
        for (std::size_t y = 0; y < 64; ++y) others[y] &= ~own[y];
        BitRows shared = others;
        share_out(own, shared, steps, width, height);
        for (int step = 0; step < steps; ++step) {
            const BitRows ours = own;
            const BitRows theirs = others;
            const auto grow = step % 2 == 0 ? grow_cross : grow_square;
            grow(own, height);
            grow(others, height);
            for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
                own[y] &= ~theirs[y] & row_mask(width);
                others[y] &= ~(ours[y] | own[y]) & row_mask(width);
            }
        }
        for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) ASSERT_EQ(shared[y], others[y]);
    }
}

TEST(BitRows, AStackIsConnectedWithoutHoles) {
    BitRows rows{};
    rows[3] = 0b00111000U;
    rows[4] = 0b11000000U;  // touches diagonally
    rows[5] = 0b01100000U;
    EXPECT_TRUE(is_one_stack(rows, 3, 6));
    EXPECT_FALSE(is_one_stack(rows, 3, 7));  // an empty row
    rows[5] = 0b00011000U;
    EXPECT_FALSE(is_one_stack(rows, 3, 6));  // apart
    rows[5] = 0b11010000U;
    EXPECT_FALSE(is_one_stack(rows, 3, 6));  // two runs
}

TEST(BitRows, TheBoxHoldsAllBitsAndNoMore) {
    BitRows rows{};
    const BitBox none = box_of(rows, 0, 64);
    EXPECT_EQ(none.top, none.bottom);
    rows[5] = 0b0110U;
    rows[9] = std::uint64_t{1} << 63;
    const BitBox box = box_of(rows, 0, 64);
    EXPECT_EQ(box.left, 1);
    EXPECT_EQ(box.top, 5);
    EXPECT_EQ(box.right, 64);
    EXPECT_EQ(box.bottom, 10);
    const BitBox wide = widened(box, 3, 64, 11);
    EXPECT_EQ(wide.left, 0);
    EXPECT_EQ(wide.top, 2);
    EXPECT_EQ(wide.right, 64);
    EXPECT_EQ(wide.bottom, 11);
}

// Repeats single steps until nothing changes: slow and plainly right.
BitRows plain_flood(BitRows seed, const BitRows& allowed, int height) {
    for (std::size_t y = 0; y < 64; ++y) seed[y] &= allowed[y];
    for (BitRows before{}; before != seed;) {
        before = seed;
        grow_square(seed, height);
        for (std::size_t y = 0; y < 64; ++y) seed[y] &= allowed[y];
    }
    return seed;
}

TEST(BitRows, FloodEqualsRepeatedGrowth) {
    SeededRandom random(5);
    for (int round = 0; round < 200; ++round) {
        const int height = 1 + static_cast<int>(random.below(64));
        const BitRows allowed = random_rows(random, 64, height, random.uniform(0.2, 0.7));
        BitRows seed = random_rows(random, 64, height, 0.002);
        const BitRows expected = plain_flood(seed, allowed, height);
        flood(seed, allowed, height);
        ASSERT_EQ(seed, expected);
    }
}

TEST(BitRows, HolesAreWhatTheOutsideCannotReach) {
    SeededRandom random(6);
    for (int round = 0; round < 200; ++round) {
        const int width = 1 + static_cast<int>(random.below(64));
        const int height = 1 + static_cast<int>(random.below(64));
        const BitRows before = random_rows(random, width, height, random.uniform(0.3, 0.8));
        BitRows filled = before;
        fill_holes(filled, width, height);
        // plain: walk from every border pixel over empty ones, four directions
        std::vector<int> outside(64 * 64, 0);
        std::vector<int> stack;
        const auto visit = [&](int x, int y) {
            if (x < 0 || y < 0 || x >= width || y >= height || bit(before, x, y)) return;
            int& mark = outside[static_cast<std::size_t>(y * 64 + x)];
            if (mark == 0) stack.push_back(y * 64 + x);
            mark = 1;
        };
        for (int i = 0; i < 64; ++i) visit(i, 0), visit(i, height - 1), visit(0, i), visit(width - 1, i);
        while (!stack.empty()) {
            const int at = stack.back();
            stack.pop_back();
            visit(at % 64 + 1, at / 64), visit(at % 64 - 1, at / 64), visit(at % 64, at / 64 + 1),
                visit(at % 64, at / 64 - 1);
        }
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x)
                ASSERT_EQ(bit(filled, x, y), outside[static_cast<std::size_t>(y * 64 + x)] == 0);
        }
    }
}

}  // namespace
