#include "core/image/kernels.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "core/base/check.hpp"
#include "core/image/pixel_lanes.hpp"

namespace rig {

namespace {

constexpr int kBlock = static_cast<int>(kBlockPx);
constexpr std::size_t kLanes = kByteLanes;

static_assert(kBlockPx == 4, "the block sums below are written for four pixels");

using ColumnSums = std::array<std::uint16_t, kMaxImageWidth / 2>;

// Of four rows: sums of pairs of columns, for the first `pairs` of them.
void add_rows(const ImageView& image, int top, std::size_t pairs, ColumnSums& sums) {
    const std::uint8_t* row[kBlock];
    for (int i = 0; i < kBlock; ++i) row[i] = image.row(top + i);
    std::size_t p = 0;
    for (; p + kLanes / 2 <= pairs; p += kLanes / 2) {
        const EightSums sum =
            (sums_of_pairs(load_bytes(row[0] + 2 * p)) + sums_of_pairs(load_bytes(row[1] + 2 * p))) +
            (sums_of_pairs(load_bytes(row[2] + 2 * p)) + sums_of_pairs(load_bytes(row[3] + 2 * p)));
        std::memcpy(&sums[p], &sum, sizeof(sum));
    }
    for (; p < pairs; ++p) {
        unsigned sum = 0;
        for (const std::uint8_t* pixels : row) sum += pixels[2 * p] + unsigned{pixels[2 * p + 1]};
        sums[p] = static_cast<std::uint16_t>(sum);
    }
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
    static constexpr int kNeutral = 0;
    static SixteenBytes of(SixteenBytes a, SixteenBytes b) { return a > b ? a : b; }
};
struct Min {
    static constexpr int kNeutral = 255;
    static SixteenBytes of(SixteenBytes a, SixteenBytes b) { return a < b ? a : b; }
};

// In place: entry i becomes the extreme of the `length` entries from i on, `stride` apart, as far as they are
// among the `count`; by doubling: after each round it covers `span` of them. Whole vectors are read and
// written: up to one beyond the end.
template <class Op>
void extend(std::uint8_t* values, std::size_t count, std::size_t stride, std::size_t length) {
    const auto widen = [&](std::size_t shift) {
        for (std::size_t i = 0; i + shift < count; i += kLanes) {
            store_bytes(Op::of(load_bytes(values + i), load_bytes(values + i + shift)), values + i);
        }
    };
    std::size_t span = 1;
    for (; span * 2 <= length; span *= 2) widen(span * stride);
    if (span < length) widen((length - span) * stride);
}

// The grid in a frame of neutral elements `radius` wide, so that rows and columns need no ends.
template <class Op>
void slide(const BlockGrid& grid, int radius, std::span<std::uint8_t> scratch) {
    RIG_CHECK(radius >= 0 && radius <= kMaxSlideRadius);
    const auto reach = static_cast<std::size_t>(radius);
    const auto width = static_cast<std::size_t>(grid.width);
    const auto height = static_cast<std::size_t>(grid.height);
    RIG_CHECK(scratch.size() >= slide_scratch_bytes(grid.width, grid.height, radius));
    const std::size_t pitch = width + 2 * reach;
    std::memset(scratch.data(), Op::kNeutral, slide_scratch_bytes(grid.width, grid.height, radius));
    for (std::size_t y = 0; y < height; ++y) {
        std::memcpy(&scratch[(y + reach) * pitch + reach], &grid.values[y * width], width);
    }
    extend<Op>(&scratch[reach * pitch], height * pitch, 1, 2 * reach + 1);
    extend<Op>(scratch.data(), (height + 2 * reach) * pitch, pitch, 2 * reach + 1);
    for (std::size_t y = 0; y < height; ++y) {
        std::memcpy(&grid.values[y * width], &scratch[y * pitch], width);
    }
}

// Levels of a row of blocks for each of its pixels; beyond `width`, for a vector's length, levels that no
// pixel is beyond.
void spread_levels(const BlockGrid& thresholds, int block_y, Side side, std::size_t width,
                   std::uint8_t* levels) {
    const auto blocks = static_cast<std::size_t>(thresholds.width);
    const std::uint8_t* row = &thresholds.values[static_cast<std::size_t>(block_y) * blocks];
    for (std::size_t b = 0; b < blocks; ++b) {
        const std::uint32_t four_times = row[b] * 0x01010101U;
        std::memcpy(levels + b * kBlockPx, &four_times, kBlockPx);
    }
    std::memset(levels + width, side == Side::kBelow ? 0 : 255, kLanes);
}

template <Side kSide>
SixteenBytes beyond(const std::uint8_t* pixels, const std::uint8_t* levels) {
    const SixteenBytes v = load_bytes(pixels);
    const SixteenBytes level = load_bytes(levels);
    return reinterpret_cast<SixteenBytes>(kSide == Side::kBelow ? v < level : v > level);
}

// The last pixels of a row, fewer than a vector, as one.
std::array<std::uint8_t, kLanes> last_pixels(const std::uint8_t* pixels, std::size_t count) {
    std::array<std::uint8_t, kLanes> rest{};
    std::memcpy(rest.data(), pixels, count);
    return rest;
}

constexpr std::size_t kScan = 2 * kLanes;  // pixels looked at in one step

// Runs of one row; whole vectors of its pixels and levels at a time.
class RowScan {
  public:
    RowScan(int y, Run* runs) : y_(static_cast<std::uint16_t>(y)), runs_(runs) {}

    // kScan or kLanes pixels.
    template <Side kSide>
    void look_at_two(const std::uint8_t* pixels, const std::uint8_t* levels, std::size_t from) {
        const SixteenBytes low = beyond<kSide>(pixels, levels);
        const SixteenBytes high = beyond<kSide>(pixels + kLanes, levels + kLanes);
        if (open_ || any_bit(low | high))
            add(bits_of_bytes(low) | bits_of_bytes(high) << kLanes, kScan, from);
    }
    template <Side kSide>
    void look_at_one(const std::uint8_t* pixels, const std::uint8_t* levels, std::size_t from) {
        const SixteenBytes mask = beyond<kSide>(pixels, levels);
        if (open_ || any_bit(mask)) add(bits_of_bytes(mask), kLanes, from);
    }
    std::size_t close(std::size_t width) {
        if (open_) end(width);
        return count_;
    }

  private:
    void add(std::uint32_t bits, std::size_t count, std::size_t from) {
        const auto these = static_cast<std::uint32_t>((std::uint64_t{1} << count) - 1);
        std::uint32_t changes = (bits ^ (bits << 1 | (open_ ? 1U : 0U))) & these;
        for (; changes != 0; changes &= changes - 1) {
            const std::size_t at = from + static_cast<std::size_t>(std::countr_zero(changes));
            if (open_) {
                end(at);
            } else {
                begin_ = static_cast<std::uint16_t>(at);
                open_ = true;
            }
        }
    }
    void end(std::size_t at) {
        runs_[count_++] = {y_, begin_, static_cast<std::uint16_t>(at)};
        open_ = false;
    }

    std::uint16_t y_;
    std::uint16_t begin_ = 0;
    bool open_ = false;
    std::size_t count_ = 0;
    Run* runs_;
};

// `levels` is neutral beyond the width.
template <Side kSide>
std::size_t scan_row(const std::uint8_t* pixels, const std::uint8_t* levels, int y, std::size_t width,
                     Run* runs) {
    RowScan scan(y, runs);
    std::size_t x = 0;
    for (; x + kScan <= width; x += kScan) scan.look_at_two<kSide>(pixels + x, levels + x, x);
    if (x + kLanes <= width) {
        scan.look_at_one<kSide>(pixels + x, levels + x, x);
        x += kLanes;
    }
    if (x < width) {
        scan.look_at_one<kSide>(last_pixels(pixels + x, width - x).data(), levels + x, x);
    }
    return scan.close(width);
}

template <Side kSide>
std::uint64_t bits_of_row(const std::uint8_t* pixels, const std::uint8_t* levels, std::size_t width) {
    std::uint64_t bits = 0;
    std::size_t x = 0;
    for (; x + kLanes <= width; x += kLanes) {
        const SixteenBytes mask = beyond<kSide>(pixels + x, levels + x);
        if (any_bit(mask)) bits |= std::uint64_t{bits_of_bytes(mask)} << x;
    }
    if (x < width) {
        const auto rest = last_pixels(pixels + x, width - x);
        bits |= std::uint64_t{bits_of_bytes(beyond<kSide>(rest.data(), levels + x))} << x;
    }
    return bits;
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
            add_rows(image, by * kBlock, 2 * whole, sums);
            for (; done < whole; ++done)
                out[done] = static_cast<std::uint8_t>((sums[2 * done] + sums[2 * done + 1] + 8) >> 4);
        }
        for (; done < width; ++done) out[done] = edge_block_mean(image, static_cast<int>(done), by);
    }
    return grid;
}

LumaSums luma_sums(const ImageView& image, int row_step) {
    RIG_CHECK(is_processable(image) && row_step > 0);
    constexpr std::size_t kRoom = 65535 / 510 * kLanes;  // pixels whose sums of pairs 16 bits hold
    LumaSums sums;
    const auto width = static_cast<std::size_t>(image.width_px);
    for (int y = 0; y < image.height_px; y += row_step) {
        const std::uint8_t* pixels = image.row(y);
        std::size_t x = 0;
        while (x + kLanes <= width) {
            EightSums sum{};
            EightSums saturated{};
            for (const std::size_t end = std::min(width, x + kRoom); x + kLanes <= end; x += kLanes) {
                const SixteenBytes v = load_bytes(pixels + x);
                sum += sums_of_pairs(v);
                saturated += sums_of_pairs(reinterpret_cast<SixteenBytes>(v == SixteenBytes{} + 255) & 1);
            }
            for (std::size_t i = 0; i < kLanes / 2; ++i) sums.sum += sum[i], sums.saturated += saturated[i];
        }
        for (; x < width; ++x) sums.sum += pixels[x], sums.saturated += pixels[x] == 255 ? 1U : 0U;
        sums.samples += static_cast<std::uint32_t>(width);
    }
    return sums;
}

void sliding_max(const BlockGrid& grid, int radius, std::span<std::uint8_t> scratch) {
    slide<Max>(grid, radius, scratch);
}

void sliding_min(const BlockGrid& grid, int radius, std::span<std::uint8_t> scratch) {
    slide<Min>(grid, radius, scratch);
}

std::size_t threshold_runs(const ImageView& image, const BlockGrid& thresholds, Side side,
                           std::span<Run> runs, bool& truncated) {
    RIG_CHECK(is_processable(image));
    RIG_CHECK(thresholds.width == blocks_across(image.width_px) &&
              thresholds.height == blocks_across(image.height_px));
    truncated = false;
    const auto width = static_cast<std::size_t>(image.width_px);
    std::array<std::uint8_t, kMaxImageWidth + kLanes> levels;
    std::size_t count = 0;
    for (int y = 0; y < image.height_px; ++y) {
        if (y % kBlock == 0) {
            spread_levels(thresholds, y / kBlock, side, width, levels.data());
        }
        if (runs.size() - count < width / 2 + 1) {  // the most runs a row can have
            truncated = true;
            break;
        }
        count += side == Side::kBelow
                     ? scan_row<Side::kBelow>(image.row(y), levels.data(), y, width, &runs[count])
                     : scan_row<Side::kAbove>(image.row(y), levels.data(), y, width, &runs[count]);
    }
    return count;
}

void threshold_bits(const ImageView& image, const BlockGrid& thresholds, Side side,
                    std::span<std::uint64_t> rows) {
    RIG_CHECK(is_processable(image) && image.width_px <= 64);
    RIG_CHECK(rows.size() >= static_cast<std::size_t>(image.height_px));
    RIG_CHECK(thresholds.width == blocks_across(image.width_px) &&
              thresholds.height == blocks_across(image.height_px));
    const auto width = static_cast<std::size_t>(image.width_px);
    std::array<std::uint8_t, 64 + kLanes> levels;
    for (int y = 0; y < image.height_px; ++y) {
        if (y % kBlock == 0) spread_levels(thresholds, y / kBlock, side, width, levels.data());
        rows[static_cast<std::size_t>(y)] =
            side == Side::kBelow ? bits_of_row<Side::kBelow>(image.row(y), levels.data(), width)
                                 : bits_of_row<Side::kAbove>(image.row(y), levels.data(), width);
    }
}

}  // namespace rig
