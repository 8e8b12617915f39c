// Pixel kernels: block means, sliding extremes, thresholding into horizontal runs. Integers only, plain loops
// that a compiler turns into vector code; the same bytes at any optimisation level. Not for: deciding what a
// marker is.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/image/view.hpp"
#include "core/limits.hpp"

namespace rig {

// A grid of one byte per block of kBlockPx x kBlockPx pixels; block (x, y) is values[y * width + x].
struct BlockGrid {
    std::span<std::uint8_t> values;
    int width = 0;
    int height = 0;
};

[[nodiscard]] constexpr int blocks_across(int pixels) {
    return (pixels + static_cast<int>(kBlockPx) - 1) / static_cast<int>(kBlockPx);
}

// Pixels [begin, end) of row y.
struct Run {
    std::uint16_t y = 0;
    std::uint16_t begin = 0;
    std::uint16_t end = 0;
};

struct LumaSums {
    std::uint64_t sum = 0;
    std::uint32_t saturated = 0;  // pixels of 255
    std::uint32_t samples = 0;
};

// True if the kernels below can take the image: not empty and within kMaxImageWidth x kMaxImageHeight.
[[nodiscard]] bool is_processable(const ImageView& image);

// Mean of every block, rounded to nearest; blocks at the right and lower edge average the pixels they have.
// `storage` holds at least the grid's blocks. Precondition: is_processable(image).
[[nodiscard]] BlockGrid block_means(const ImageView& image, std::span<std::uint8_t> storage);

// Of every `row_step`-th row.
[[nodiscard]] LumaSums luma_sums(const ImageView& image, int row_step);

inline constexpr int kMaxSlideRadius = 12;

[[nodiscard]] constexpr std::size_t slide_scratch_bytes(int width, int height, int radius) {
    const auto framed = [radius](int side) { return static_cast<std::size_t>(side + 2 * radius); };
    return framed(width) * framed(height) + 32;  // whole vectors reach beyond the end
}

// Extreme over the (2 radius + 1)^2 neighbourhood, clipped at the border, in place. 0 <= radius <=
// kMaxSlideRadius. `scratch` holds at least slide_scratch_bytes().
void sliding_max(const BlockGrid& grid, int radius, std::span<std::uint8_t> scratch);
void sliding_min(const BlockGrid& grid, int radius, std::span<std::uint8_t> scratch);

enum class Side : std::uint8_t { kBelow, kAbove };

// Every level L moves away from the background, down for what is below it and up for what is above: by
// max(least, L part / 256), down to 0 or up to 250. 0 <= least <= 255, 0 <= part <= 256.
void step_levels(const BlockGrid& grid, Side side, int least, int part);

// Runs of pixels strictly below (above) the threshold of their block, in raster order; a pixel none of whose
// eight neighbours is beyond it is noise and left out. Returns how many were written; stops at the end of a
// row that might not fit and then sets `truncated`.
[[nodiscard]] std::size_t threshold_runs(const ImageView& image, const BlockGrid& thresholds, Side side,
                                         std::span<Run> runs, bool& truncated);

// All such pixels as bits, lone ones too: pixel x of row y is bit x of rows[y]. The image is at most 64
// pixels wide, `rows` at least as long as it is high.
void threshold_bits(const ImageView& image, const BlockGrid& thresholds, Side side,
                    std::span<std::uint64_t> rows);

}  // namespace rig
