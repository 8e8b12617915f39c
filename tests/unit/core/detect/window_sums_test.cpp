// Sums over the pixels of a window against one pixel after the other.
#include "core/detect/window_sums.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "tests/support/random.hpp"

namespace {

using namespace rig;
using test::SeededRandom;

bool bit(const BitRows& rows, int x, int y) {
    return (rows[static_cast<std::size_t>(y)] >> x & 1U) != 0;
}

// A window of noise whose rows are longer than it: what lies beyond must not count.
std::unique_ptr<BlobWorkspace> random_window(SeededRandom& random) {
    auto w = std::make_unique<BlobWorkspace>();
    w->width = 1 + static_cast<int>(random.below(64));
    w->height = 1 + static_cast<int>(random.below(64));
    for (auto& row : w->values) {
        for (std::uint8_t& value : row) value = static_cast<std::uint8_t>(random.below(256));
    }
    for (auto& row : w->cover) {
        for (std::int16_t& cover : row) cover = static_cast<std::int16_t>(random.uniform(-256.0, 512.0));
    }
    return w;
}

BitRows random_bits(SeededRandom& random, const BlobWorkspace& w, double density) {
    BitRows rows{};
    for (int y = 0; y < w.height; ++y) {
        for (int x = 0; x < w.width; ++x) {
            if (random.chance(density)) rows[static_cast<std::size_t>(y)] |= std::uint64_t{1} << x;
        }
    }
    return rows;
}

TEST(WindowSums, CoveredBitsAreThePixelsThatReachTheLevel) {
    SeededRandom random(1);
    for (int round = 0; round < 50; ++round) {
        const auto w = random_window(random);
        const int left = static_cast<int>(random.below(static_cast<std::uint32_t>(w->width)));
        const int least = static_cast<int>(random.uniform(-300.0, 520.0));
        for (int y = 0; y < w->height; ++y) {
            const std::uint64_t bits = covered_bits(*w, y, left, w->width, least);
            for (int x = left; x < w->width; ++x) {
                const int cover = w->cover[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)];
                ASSERT_EQ((bits >> x & 1U) != 0, cover >= least);
            }
        }
    }
}

TEST(WindowSums, PercentileIsTheValueOfThatRank) {
    SeededRandom random(2);
    for (int round = 0; round < 200; ++round) {
        const auto w = random_window(random);
        const BitRows marked = random_bits(random, *w, random.uniform(0.0, 0.4));
        std::vector<int> values;
        for (int y = 0; y < w->height; ++y) {
            for (int x = 0; x < w->width; ++x) {
                if (bit(marked, x, y))
                    values.push_back(w->values[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)]);
            }
        }
        std::sort(values.begin(), values.end());
        const BitBox box = box_of(marked, 0, w->height);
        for (const int percent : {0, 30, 50, 99}) {
            const std::size_t rank = values.size() * static_cast<std::size_t>(percent) / 100;
            EXPECT_EQ(percentile(*w, marked, box, percent), values.empty() ? 0 : values[rank]);
        }
    }
}

TEST(WindowSums, ABandKeepsExactlyItsPixels) {
    SeededRandom random(3);
    for (int round = 0; round < 200; ++round) {
        const auto w = random_window(random);
        const BitRows marked = random_bits(random, *w, 0.3);
        const LevelBand band{static_cast<int>(random.uniform(-20000.0, 60000.0)),
                             static_cast<int>(random.uniform(-3000.0, 3000.0)),
                             static_cast<int>(random.uniform(-3000.0, 3000.0)),
                             static_cast<int>(random.uniform(0.0, 40000.0))};
        const int cx = w->width / 2;
        const int cy = w->height / 2;
        PlaneSums plain;
        for (int py = 0; py < w->height; ++py) {
            for (int px = 0; px < w->width; ++px) {
                const int v = w->values[static_cast<std::size_t>(py)][static_cast<std::size_t>(px)];
                const int x = px - cx;
                const int y = py - cy;
                const int over = v * kLevelFraction - band.lowest - band.slope_x * x - band.slope_y * y;
                if (!bit(marked, px, py) || over < 0 || over > band.reach) continue;
                plain.n += 1, plain.x += x, plain.y += y, plain.v += v;
                plain.xx += x * x, plain.xy += x * y, plain.yy += y * y;
                plain.xv += x * v, plain.yv += y * v, plain.vv += v * v;
            }
        }
        const PlaneSums sums = sum_in_band(*w, marked, box_of(marked, 0, w->height), band, cx, cy);
        EXPECT_EQ(sums.n, plain.n);
        EXPECT_EQ(sums.x, plain.x);
        EXPECT_EQ(sums.y, plain.y);
        EXPECT_EQ(sums.v, plain.v);
        EXPECT_EQ(sums.xx, plain.xx);
        EXPECT_EQ(sums.xy, plain.xy);
        EXPECT_EQ(sums.yy, plain.yy);
        EXPECT_EQ(sums.xv, plain.xv);
        EXPECT_EQ(sums.yv, plain.yv);
        EXPECT_EQ(sums.vv, plain.vv);
    }
}

TEST(WindowSums, WeightsRiseWithTheCoverAndAreWholeInside) {
    SeededRandom random(4);
    constexpr int kOutline = 128;
    constexpr int kRamp = 64;
    for (int round = 0; round < 200; ++round) {
        const auto w = random_window(random);
        const BitRows region = random_bits(random, *w, 0.6);
        BitRows rim = random_bits(random, *w, 0.5);
        BitRows inner = random_bits(random, *w, 0.5);
        for (std::size_t y = 0; y < rim.size(); ++y) rim[y] &= region[y], inner[y] &= rim[y];
        const BitBox box = box_of(region, 0, w->height);
        WeightSums plain;
        for (int py = box.top; py < box.bottom; ++py) {
            for (int px = box.left; px < box.right; ++px) {
                if (!bit(region, px, py)) continue;
                const int cover = w->cover[static_cast<std::size_t>(py)][static_cast<std::size_t>(px)];
                const int least = bit(inner, px, py) ? 2 * kRamp : bit(rim, px, py) ? kRamp : 0;
                const int weight = std::clamp(cover - kOutline + kRamp, least, 2 * kRamp);
                const int x = px - box.left;
                const int y = py - box.top;
                plain.w += weight, plain.x += weight * x, plain.y += weight * y;
                plain.xx += weight * x * x, plain.xy += weight * x * y, plain.yy += weight * y * y;
            }
        }
        const WeightSums sums = sum_weights(*w, region, rim, inner, box, kOutline, kRamp);
        EXPECT_EQ(sums.w, plain.w);
        EXPECT_EQ(sums.x, plain.x);
        EXPECT_EQ(sums.y, plain.y);
        EXPECT_EQ(sums.xx, plain.xx);
        EXPECT_EQ(sums.xy, plain.xy);
        EXPECT_EQ(sums.yy, plain.yy);
    }
}

}  // namespace
