#include "core/image/kernels.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "core/base/check.hpp"

namespace rig {

namespace {

constexpr int kBlock = static_cast<int>(kBlockPx);
constexpr int kMaxRadius = 32;
constexpr std::size_t kMaxGridSide =
    (kMaxImageWidth > kMaxImageHeight ? kMaxImageWidth : kMaxImageHeight) / kBlockPx;

static_assert(kBlockPx == 4, "the block sums below are written for four pixels");

using ColumnSums = std::array<std::uint16_t, kMaxImageWidth>;

void add_rows(const ImageView& image, int top, ColumnSums& sums) {
    const auto width = static_cast<std::size_t>(image.width_px);
    const std::uint8_t* a = image.row(top);
    const std::uint8_t* b = image.row(top + 1);
    const std::uint8_t* c = image.row(top + 2);
    const std::uint8_t* d = image.row(top + 3);
    for (std::size_t x = 0; x < width; ++x) sums[x] = static_cast<std::uint16_t>(a[x] + b[x] + c[x] + d[x]);
}

// Sum of four neighbours by one multiplication: the top 16 bits collect all four lanes, at most 4 * 1020.
std::uint32_t four(const std::uint16_t* sums) {
    std::uint64_t lanes = 0;
    std::memcpy(&lanes, sums, sizeof lanes);
    return static_cast<std::uint32_t>((lanes * 0x0001000100010001ULL) >> 48);
}

std::uint8_t edge_block_mean(const ImageView& image, int block_x, int block_y) {
    std::uint32_t sum = 0;
    std::uint32_t count = 0;
    for (int y = block_y * kBlock; y < std::min(image.height_px, (block_y + 1) * kBlock); ++y) {
        for (int x = block_x * kBlock; x < std::min(image.width_px, (block_x + 1) * kBlock); ++x) {
            sum += image.row(y)[x];
            ++count;
        }
    }
    return static_cast<std::uint8_t>((sum + count / 2) / count);
}

// One policy for maximum and one for minimum: the padding is the operation's neutral element.
struct Max {
    static constexpr std::uint8_t kNeutral = 0;
    static std::uint8_t of(std::uint8_t a, std::uint8_t b) { return a > b ? a : b; }
};
struct Min {
    static constexpr std::uint8_t kNeutral = 255;
    static std::uint8_t of(std::uint8_t a, std::uint8_t b) { return a < b ? a : b; }
};

// Windows of `length` are built by doubling: after each round line[i] covers `span` entries from i on.
template <class Op>
void slide_row(std::uint8_t* values, std::size_t count, std::size_t radius) {
    std::array<std::uint8_t, kMaxGridSide + 2 * kMaxRadius> line{};
    std::memset(line.data(), Op::kNeutral, radius);
    std::memcpy(line.data() + radius, values, count);
    std::memset(line.data() + radius + count, Op::kNeutral, radius);
    const std::size_t length = 2 * radius + 1;
    const std::size_t total = count + 2 * radius;
    std::size_t span = 1;
    for (; span * 2 <= length; span *= 2) {
        for (std::size_t i = 0; i + span < total; ++i) line[i] = Op::of(line[i], line[i + span]);
    }
    const std::size_t shift = length - span;
    for (std::size_t i = 0; i < count; ++i) values[i] = Op::of(line[i], line[i + shift]);
}

// A strip of columns is copied out so that the vertical doubling works on contiguous bytes.
constexpr std::size_t kStrip = 64;
using Strip = std::array<std::uint8_t, (kMaxGridSide + 2 * kMaxRadius) * kStrip>;

template <class Op>
void slide_strip(const BlockGrid& grid, std::size_t left, std::size_t radius, Strip& strip) {
    const auto width = static_cast<std::size_t>(grid.width);
    const auto height = static_cast<std::size_t>(grid.height);
    const std::size_t columns = std::min(kStrip, width - left);
    const std::size_t total = height + 2 * radius;
    std::memset(strip.data(), Op::kNeutral, total * kStrip);
    for (std::size_t y = 0; y < height; ++y) {
        std::memcpy(&strip[(y + radius) * kStrip], &grid.values[y * width + left], columns);
    }
    const std::size_t length = 2 * radius + 1;
    std::size_t span = 1;
    for (; span * 2 <= length; span *= 2) {
        for (std::size_t i = 0; i < (total - span) * kStrip; ++i)
            strip[i] = Op::of(strip[i], strip[i + span * kStrip]);
    }
    const std::size_t shift = (length - span) * kStrip;
    for (std::size_t i = 0; i < height * kStrip; ++i) strip[i] = Op::of(strip[i], strip[i + shift]);
    for (std::size_t y = 0; y < height; ++y)
        std::memcpy(&grid.values[y * width + left], &strip[y * kStrip], columns);
}

template <class Op>
void slide(const BlockGrid& grid, int radius) {
    RIG_CHECK(radius >= 0 && radius <= kMaxRadius);
    RIG_CHECK(grid.width > 0 && static_cast<std::size_t>(grid.width) <= kMaxGridSide);
    RIG_CHECK(grid.height > 0 && static_cast<std::size_t>(grid.height) <= kMaxGridSide);
    const auto reach = static_cast<std::size_t>(radius);
    const auto width = static_cast<std::size_t>(grid.width);
    for (std::size_t y = 0; y < static_cast<std::size_t>(grid.height); ++y) {
        slide_row<Op>(&grid.values[y * width], width, reach);
    }
    Strip strip;  // 35 kB of stack, only the part in use is touched
    for (std::size_t left = 0; left < width; left += kStrip) slide_strip<Op>(grid, left, reach, strip);
}

void mark_below(const std::uint8_t* pixels, const std::uint8_t* thresholds, std::size_t width,
                std::uint8_t* mask) {
    for (std::size_t x = 0; x < width; ++x) mask[x] = pixels[x] < thresholds[x] ? 255 : 0;
}

void mark_above(const std::uint8_t* pixels, const std::uint8_t* thresholds, std::size_t width,
                std::uint8_t* mask) {
    for (std::size_t x = 0; x < width; ++x) mask[x] = pixels[x] > thresholds[x] ? 255 : 0;
}

// `mask` is padded with zeros to a multiple of eight, plus eight, so that an open run always closes.
std::size_t scan_row(const std::uint8_t* mask, std::size_t width, int y, Run* runs) {
    std::size_t count = 0;
    std::size_t begin = 0;
    std::uint32_t open = 0;
    for (std::size_t x = 0; x <= width; x += 8) {
        std::uint64_t word = 0;
        std::memcpy(&word, mask + x, sizeof word);
        if (word == (open != 0 ? ~std::uint64_t{0} : 0)) continue;
        const std::uint32_t bits = packed_bytes(word);
        std::uint32_t changes = (bits ^ (bits << 1 | open)) & 0xFFU;
        for (; changes != 0; changes &= changes - 1) {
            const std::size_t at = x + static_cast<std::size_t>(std::countr_zero(changes));
            if (open == 0) {
                begin = at;
            } else {
                runs[count++] = {static_cast<std::uint16_t>(y), static_cast<std::uint16_t>(begin),
                                 static_cast<std::uint16_t>(at)};
            }
            open ^= 1U;
        }
    }
    return count;
}

}  // namespace

bool is_processable(const ImageView& image) {
    return !image.empty() && image.width_px <= static_cast<int>(kMaxImageWidth) &&
           image.height_px <= static_cast<int>(kMaxImageHeight);
}

BlockGrid block_means(const ImageView& image, std::span<std::uint8_t> storage) {
    RIG_CHECK(is_processable(image));
    BlockGrid grid{storage, blocks_across(image.width_px), blocks_across(image.height_px)};
    const auto width = static_cast<std::size_t>(grid.width);
    RIG_CHECK(storage.size() >= width * static_cast<std::size_t>(grid.height));
    grid.values = storage.first(width * static_cast<std::size_t>(grid.height));
    const auto whole = static_cast<std::size_t>(image.width_px / kBlock);
    ColumnSums sums;
    for (int by = 0; by < grid.height; ++by) {
        std::uint8_t* out = &grid.values[static_cast<std::size_t>(by) * width];
        const bool full_height = (by + 1) * kBlock <= image.height_px;
        std::size_t done = 0;
        if (full_height) {
            add_rows(image, by * kBlock, sums);
            for (; done < whole; ++done)
                out[done] = static_cast<std::uint8_t>((four(&sums[4 * done]) + 8) >> 4);
        }
        for (; done < width; ++done) out[done] = edge_block_mean(image, static_cast<int>(done), by);
    }
    return grid;
}

LumaSums luma_sums(const ImageView& image) {
    RIG_CHECK(is_processable(image));
    LumaSums sums;
    const auto width = static_cast<std::size_t>(image.width_px);
    for (int y = 0; y < image.height_px; y += 4) {
        const std::uint8_t* pixels = image.row(y);
        std::uint32_t sum = 0;
        std::uint32_t saturated = 0;
        for (std::size_t x = 0; x < width; ++x) sum += pixels[x];
        for (std::size_t x = 0; x < width; ++x) saturated += pixels[x] == 255 ? 1U : 0U;
        sums.sum += sum;
        sums.saturated += saturated;
        sums.samples += static_cast<std::uint32_t>(width);
    }
    return sums;
}

void sliding_max(const BlockGrid& grid, int radius) {
    slide<Max>(grid, radius);
}

void sliding_min(const BlockGrid& grid, int radius) {
    slide<Min>(grid, radius);
}

std::size_t threshold_runs(const ImageView& image, const BlockGrid& thresholds, Side side,
                           std::span<Run> runs, bool& truncated) {
    RIG_CHECK(is_processable(image));
    RIG_CHECK(thresholds.width == blocks_across(image.width_px) &&
              thresholds.height == blocks_across(image.height_px));
    truncated = false;
    const auto width = static_cast<std::size_t>(image.width_px);
    const auto blocks = static_cast<std::size_t>(thresholds.width);
    std::array<std::uint8_t, kMaxImageWidth> levels;
    std::array<std::uint8_t, kMaxImageWidth + 16> mask;
    std::memset(&mask[width], 0, 16);
    std::size_t count = 0;
    for (int y = 0; y < image.height_px; ++y) {
        if (y % kBlock == 0) {
            const std::uint8_t* row = &thresholds.values[static_cast<std::size_t>(y / kBlock) * blocks];
            for (std::size_t b = 0; b < blocks; ++b) {
                const std::uint32_t four_times = row[b] * 0x01010101U;
                std::memcpy(&levels[b * kBlockPx], &four_times, kBlockPx);
            }
        }
        if (runs.size() - count < width / 2 + 1) {  // the most runs a row can have
            truncated = true;
            break;
        }
        if (side == Side::kBelow) {
            mark_below(image.row(y), levels.data(), width, mask.data());
        } else {
            mark_above(image.row(y), levels.data(), width, mask.data());
        }
        count += scan_row(mask.data(), width, y, &runs[count]);
    }
    return count;
}

}  // namespace rig
