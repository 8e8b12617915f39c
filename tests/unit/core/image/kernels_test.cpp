// Every kernel against the plain loop that says what it means, over many sizes and strides.
#include "core/image/kernels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/support/random.hpp"

namespace {

using namespace rig;
using test::SeededRandom;

struct Canvas {
    std::vector<std::uint8_t> bytes;
    ImageView view;
};

Canvas random_canvas(SeededRandom& random, int width, int height, int extra_stride) {
    Canvas canvas;
    canvas.bytes.resize(static_cast<std::size_t>(height) * static_cast<std::size_t>(width + extra_stride));
    for (std::uint8_t& byte : canvas.bytes) byte = static_cast<std::uint8_t>(random.bits());
    canvas.view = {.pixels = canvas.bytes.data(),
                   .width_px = width,
                   .height_px = height,
                   .stride_bytes = width + extra_stride};
    return canvas;
}

struct Size {
    int width;
    int height;
};
constexpr Size kSizes[] = {{1, 1}, {3, 2}, {4, 4}, {5, 9}, {63, 7}, {64, 8}, {65, 66}, {130, 31}, {641, 12}};

TEST(Kernels, BlockMeansAreRoundedMeansOfThePixelsThereAre) {
    SeededRandom random(1);
    for (const Size size : kSizes) {
        const Canvas canvas = random_canvas(random, size.width, size.height, 3);
        std::vector<std::uint8_t> storage(kMaxBlocks);
        const BlockGrid grid = block_means(canvas.view, storage);
        ASSERT_EQ(grid.width, (size.width + 3) / 4);
        ASSERT_EQ(grid.height, (size.height + 3) / 4);
        for (int by = 0; by < grid.height; ++by) {
            for (int bx = 0; bx < grid.width; ++bx) {
                unsigned sum = 0;
                unsigned count = 0;
                for (int y = 4 * by; y < std::min(size.height, 4 * by + 4); ++y) {
                    for (int x = 4 * bx; x < std::min(size.width, 4 * bx + 4); ++x) {
                        sum += canvas.view.row(y)[x];
                        ++count;
                    }
                }
                ASSERT_EQ(grid.values[static_cast<std::size_t>(by * grid.width + bx)],
                          (sum + count / 2) / count);
            }
        }
    }
}

template <class Pick>
std::vector<std::uint8_t> plain_extreme(const std::vector<std::uint8_t>& values, int width, int height,
                                        int radius, Pick pick) {
    std::vector<std::uint8_t> result;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            std::uint8_t best = values[static_cast<std::size_t>(y * width + x)];
            for (int v = std::max(0, y - radius); v <= std::min(height - 1, y + radius); ++v) {
                for (int u = std::max(0, x - radius); u <= std::min(width - 1, x + radius); ++u) {
                    best = pick(best, values[static_cast<std::size_t>(v * width + u)]);
                }
            }
            result.push_back(best);
        }
    }
    return result;
}

TEST(Kernels, SlidingExtremesEqualThePlainSearch) {
    SeededRandom random(2);
    for (const Size size : {Size{1, 1}, Size{7, 3}, Size{64, 20}, Size{65, 9}, Size{130, 40}}) {
        for (const int radius : {0, 1, 2, 3, 4, 7, 12}) {
            std::vector<std::uint8_t> values(static_cast<std::size_t>(size.width * size.height));
            for (std::uint8_t& value : values) value = static_cast<std::uint8_t>(random.bits());
            std::vector<std::uint8_t> high = values;
            std::vector<std::uint8_t> low = values;
            std::vector<std::uint8_t> scratch(slide_scratch_bytes(size.width, size.height, radius));
            sliding_max({high, size.width, size.height}, radius, scratch);
            sliding_min({low, size.width, size.height}, radius, scratch);
            using Byte = std::uint8_t;
            EXPECT_EQ(high, plain_extreme(values, size.width, size.height, radius,
                                          [](Byte a, Byte b) { return std::max(a, b); }));
            EXPECT_EQ(low, plain_extreme(values, size.width, size.height, radius,
                                         [](Byte a, Byte b) { return std::min(a, b); }));
        }
    }
}

TEST(Kernels, LevelsMoveAwayFromTheBackgroundByTheGreaterStep) {
    SeededRandom random(12);
    for (const int blocks : {1, 7, 16, 300}) {
        for (const Side side : {Side::kBelow, Side::kAbove}) {
            std::vector<std::uint8_t> levels(static_cast<std::size_t>(blocks));
            for (std::uint8_t& level : levels) level = static_cast<std::uint8_t>(random.bits());
            const std::vector<std::uint8_t> before = levels;
            const int least = static_cast<int>(random.below(256));
            const int part = static_cast<int>(random.below(257));
            step_levels({levels, blocks, 1}, side, least, part);
            for (std::size_t i = 0; i < levels.size(); ++i) {
                const int step = std::max(least, before[i] * part >> 8);
                const int expected =
                    side == Side::kBelow ? std::max(0, before[i] - step) : std::min(250, before[i] + step);
                ASSERT_EQ(levels[i], expected);
            }
        }
    }
}

TEST(Kernels, RunsAreExactlyThePixelsBeyondTheThresholdThatHaveNeighbours) {
    SeededRandom random(3);
    for (const Size size : kSizes) {
        for (const Side side : {Side::kBelow, Side::kAbove}) {
            const Canvas canvas = random_canvas(random, size.width, size.height, 5);
            std::vector<std::uint8_t> storage(kMaxBlocks);
            BlockGrid levels = block_means(canvas.view, storage);
            for (std::uint8_t& level : levels.values) level = static_cast<std::uint8_t>(random.bits());
            std::vector<rig::Run> runs(kMaxRuns);
            bool truncated = true;
            const std::size_t count = threshold_runs(canvas.view, levels, side, runs, truncated);
            EXPECT_FALSE(truncated);
            std::vector<std::uint8_t> painted(static_cast<std::size_t>(size.width * size.height), 0);
            for (std::size_t i = 0; i < count; ++i) {
                ASSERT_LT(runs[i].begin, runs[i].end);
                if (i > 0 && runs[i].y == runs[i - 1].y) {
                    ASSERT_GT(runs[i].begin, runs[i - 1].end);
                }
                for (int x = runs[i].begin; x < runs[i].end; ++x)
                    painted[static_cast<std::size_t>(runs[i].y * size.width + x)] = 1;
            }
            const auto beyond = [&](int x, int y) {
                if (x < 0 || y < 0 || x >= size.width || y >= size.height) return false;
                const int level = levels.values[static_cast<std::size_t>(y / 4 * levels.width + x / 4)];
                const int value = canvas.view.row(y)[x];
                return side == Side::kBelow ? value < level : value > level;
            };
            for (int y = 0; y < size.height; ++y) {
                for (int x = 0; x < size.width; ++x) {
                    bool kept = false;
                    for (int d = 0; d < 9; ++d) kept |= d != 4 && beyond(x + d % 3 - 1, y + d / 3 - 1);
                    kept &= beyond(x, y);
                    ASSERT_EQ(painted[static_cast<std::size_t>(y * size.width + x)] != 0, kept)
                        << x << " " << y;
                }
            }
        }
    }
}

TEST(Kernels, TooManyRunsStopAtARowAndSaySo) {
    constexpr int kWidth = 64;
    std::vector<std::uint8_t> bytes(kWidth * kWidth);
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = i % 2 == 0 ? 0 : 200;
    const ImageView view{
        .pixels = bytes.data(), .width_px = kWidth, .height_px = kWidth, .stride_bytes = kWidth};
    std::vector<std::uint8_t> storage(kMaxBlocks);
    BlockGrid levels = block_means(view, storage);
    std::vector<rig::Run> runs(100);
    bool truncated = false;
    const std::size_t count = threshold_runs(view, levels, Side::kBelow, runs, truncated);
    EXPECT_TRUE(truncated);
    EXPECT_EQ(count, 96U);  // three rows of 32; a fourth might not fit
}

TEST(Kernels, LumaCountsEveryRowOfTheStep) {
    std::vector<std::uint8_t> bytes(8 * 10, 10);
    for (std::size_t x = 0; x < 8; ++x) bytes[4 * 8 + x] = 255;
    const LumaSums sums =
        luma_sums({.pixels = bytes.data(), .width_px = 8, .height_px = 10, .stride_bytes = 8}, 4);
    EXPECT_EQ(sums.samples, 24U);
    EXPECT_EQ(sums.saturated, 8U);
    EXPECT_EQ(sums.sum, 16U * 10U + 8U * 255U);
}

TEST(Kernels, ProcessableMeansPixelsWithinTheLimits) {
    std::uint8_t pixel = 0;
    EXPECT_FALSE(is_processable({}));
    EXPECT_FALSE(is_processable({.pixels = &pixel, .width_px = 0, .height_px = 4, .stride_bytes = 0}));
    EXPECT_FALSE(is_processable(
        {.pixels = &pixel, .width_px = kMaxImageWidth + 1, .height_px = 1, .stride_bytes = 0}));
    EXPECT_FALSE(is_processable(
        {.pixels = &pixel, .width_px = 1, .height_px = kMaxImageHeight + 1, .stride_bytes = 0}));
    EXPECT_TRUE(is_processable({.pixels = &pixel, .width_px = 1, .height_px = 1, .stride_bytes = 1}));
}

}  // namespace
