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

// Of sixteen columns and four rows: sums of the four blocks.
FourInts block_sums(const std::uint8_t* const (&row)[kBlock], std::size_t x) {
    EightSums even{};
    EightSums odd{};
    for (const std::uint8_t* pixels : row) {
        const auto pairs = reinterpret_cast<EightSums>(load_bytes(pixels + x));
        even += pairs & 0xFF, odd += pairs >> 8;
    }
    return products_of_pairs(reinterpret_cast<PixelLanes>(even + odd), all_lanes(1));
}

// Means of a row of whole blocks, sixteen at a time. Returns how many are done.
std::size_t means_of_row(const ImageView& image, int block_y, std::size_t blocks, std::uint8_t* means) {
    const std::uint8_t* row[kBlock];
    for (int i = 0; i < kBlock; ++i) row[i] = image.row(block_y * kBlock + i);
    std::size_t done = 0;
    for (; done + kLanes <= blocks; done += kLanes) {
        const std::size_t x = done * kBlockPx;
        const PixelLanes low = lanes_of_ints({block_sums(row, x), block_sums(row, x + kLanes)});
        const PixelLanes high =
            lanes_of_ints({block_sums(row, x + 2 * kLanes), block_sums(row, x + 3 * kLanes)});
        store_bytes(bytes_of_lanes((low + 8) >> 4, (high + 8) >> 4), means + done);
    }
    for (; done + kBlockPx <= blocks; done += kBlockPx) {
        const FourInts sums = (block_sums(row, done * kBlockPx) + 8) >> 4;
        for (int i = 0; i < kBlock; ++i)
            means[done + static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(sums[i]);
    }
    return done;
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
        if (count <= shift) return;
        const std::size_t vectors = (count - shift + kLanes - 1) / kLanes;
        std::uint8_t* at = values;
        for (std::size_t i = 0; i < vectors; ++i, at += kLanes)
            store_bytes(Op::of(load_bytes(at), load_bytes(at + shift)), at);
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

// The last pixels of a row, fewer than a vector, as one.
std::array<std::uint8_t, kLanes> last_pixels(const std::uint8_t* pixels, std::size_t count) {
    std::array<std::uint8_t, kLanes> rest{};
    std::memcpy(rest.data(), pixels, count);
    return rest;
}

// One bit for each of sixteen pixels that is not beyond its level.
template <Side kSide>
std::uint64_t within(SixteenBytes pixels, SixteenBytes levels) {
    const SixteenBytes extreme =
        kSide == Side::kBelow ? (pixels > levels ? pixels : levels) : (pixels < levels ? pixels : levels);
    return bits_of_bytes(reinterpret_cast<SixteenBytes>(extreme == pixels));
}

constexpr std::size_t kWordPx = 64;
constexpr std::size_t kMaxWords = kMaxImageWidth / kWordPx;
static_assert(kMaxImageWidth % kWordPx == 0);

// A row of pixels, 64 a word.
using RowWords = std::array<std::uint64_t, kMaxWords>;

// One row of blocks: its levels, and its rows of pixels, as many as there are.
struct BlockRow {
    const std::uint8_t* levels;
    std::array<const std::uint8_t*, kBlock> pixels{};
    std::size_t rows = 0;
};

// The pixel that is farthest beyond any level, of each of sixteen columns.
template <Side kSide, std::size_t kRows>
SixteenBytes extremes(const BlockRow& of, std::size_t x) {
    SixteenBytes extreme = load_bytes(of.pixels[0] + x);
    for (std::size_t r = 1; r < kRows; ++r) {
        const SixteenBytes other = load_bytes(of.pixels[r] + x);
        extreme =
            kSide == Side::kBelow ? (extreme < other ? extreme : other) : (extreme > other ? extreme : other);
    }
    return extreme;
}

// One word from pixel `first` on, of kRows at once, so that their levels are spread once; most vectors have
// no pixel beyond.
template <Side kSide, std::size_t kRows>
void mark_word(const BlockRow& of, std::size_t first, RowWords* words) {
    std::uint64_t bits[kRows]{};
    for (std::size_t x = 0; x < kWordPx; x += kLanes) {
        const SixteenBytes levels = load_four_times_each(of.levels + (first + x) / kBlockPx);
        if (within<kSide>(extremes<kSide, kRows>(of, first + x), levels) == 0xFFFF) continue;
        for (std::size_t r = 0; r < kRows; ++r)
            bits[r] |= (within<kSide>(load_bytes(of.pixels[r] + first + x), levels) ^ 0xFFFF) << x;
    }
    for (std::size_t r = 0; r < kRows; ++r) words[r][first / kWordPx] = bits[r];
}

// The last word, where it is not whole: `pixels` of it.
template <Side kSide, std::size_t kRows>
void mark_rest(const BlockRow& of, std::size_t first, std::size_t pixels, RowWords* words) {
    std::array<std::uint8_t, kWordPx / kBlockPx> levels{};
    std::memcpy(levels.data(), of.levels + first / kBlockPx, (pixels + kBlockPx - 1) / kBlockPx);
    for (std::size_t r = 0; r < kRows; ++r) {
        std::uint64_t bits = 0;
        for (std::size_t x = 0; x < pixels; x += kLanes) {
            const std::uint8_t* from = of.pixels[r] + first + x;
            const SixteenBytes v =
                x + kLanes <= pixels ? load_bytes(from) : load_bytes(last_pixels(from, pixels - x).data());
            bits |= within<kSide>(v, load_four_times_each(&levels[x / kBlockPx])) << x;
        }
        words[r][first / kWordPx] = ~bits & ((std::uint64_t{1} << pixels) - 1);
    }
}

template <Side kSide, std::size_t kRows>
void mark_beyond(const BlockRow& of, std::size_t width, RowWords* words) {
    std::size_t first = 0;
    for (; first + kWordPx <= width; first += kWordPx) mark_word<kSide, kRows>(of, first, words);
    if (first < width) mark_rest<kSide, kRows>(of, first, width - first, words);
}

template <Side kSide>
void mark_beyond(const BlockRow& of, std::size_t width, RowWords* words) {
    switch (of.rows) {
        case 1:
            return mark_beyond<kSide, 1>(of, width, words);
        case 2:
            return mark_beyond<kSide, 2>(of, width, words);
        case 3:
            return mark_beyond<kSide, 3>(of, width, words);
        default:
            return mark_beyond<kSide, 4>(of, width, words);
    }
}

void mark_beyond(const ImageView& image, const BlockGrid& thresholds, Side side, int block_y,
                 RowWords* words) {
    BlockRow row;
    row.levels =
        &thresholds.values[static_cast<std::size_t>(block_y) * static_cast<std::size_t>(thresholds.width)];
    const int top = block_y * kBlock;
    row.rows = static_cast<std::size_t>(std::min(kBlock, image.height_px - top));
    for (std::size_t r = 0; r < row.rows; ++r) row.pixels[r] = image.row(top + static_cast<int>(r));
    const auto width = static_cast<std::size_t>(image.width_px);
    if (side == Side::kBelow) {
        mark_beyond<Side::kBelow>(row, width, words);
    } else {
        mark_beyond<Side::kAbove>(row, width, words);
    }
}

// The pixels of word k that have one of their eight neighbours marked.
std::uint64_t with_neighbour(const RowWords* row, std::size_t k, std::size_t count) {
    const auto column = [row](std::size_t at) { return row[-1][at] | row[0][at] | row[1][at]; };
    const std::uint64_t here = column(k);
    const std::uint64_t left = k > 0 ? column(k - 1) >> (kWordPx - 1) : 0;
    const std::uint64_t right = k + 1 < count ? column(k + 1) << (kWordPx - 1) : 0;
    return row[0][k] & (row[-1][k] | row[1][k] | here << 1 | here >> 1 | left | right);
}

// Runs of a row that stands between its neighbours: where a bit differs from the one before it, one begins or
// ends.
std::size_t runs_of_row(const RowWords* row, std::size_t width, int y, Run* runs) {
    std::array<std::uint16_t, kMaxImageWidth + 2> turns;
    std::size_t count = 0;
    std::uint64_t before = 0;
    const std::size_t words = (width + kWordPx - 1) / kWordPx;
    for (std::size_t k = 0; k < words; ++k) {
        if ((row[0][k] | before) == 0) continue;
        const std::uint64_t word = with_neighbour(row, k, words);
        std::uint64_t changes = word ^ (word << 1 | before);
        before = word >> (kWordPx - 1);
        for (; changes != 0; changes &= changes - 1) {
            turns[count++] =
                static_cast<std::uint16_t>(k * kWordPx + static_cast<std::size_t>(std::countr_zero(changes)));
        }
    }
    if (count % 2 != 0) turns[count++] = static_cast<std::uint16_t>(width);
    for (std::size_t i = 0; i < count / 2; ++i)
        runs[i] = {static_cast<std::uint16_t>(y), turns[2 * i], turns[2 * i + 1]};
    return count / 2;
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
    for (int by = 0; by < grid.height; ++by) {
        std::uint8_t* out = &grid.values[static_cast<std::size_t>(by) * width];
        const bool full_height = (by + 1) * kBlock <= image.height_px;
        std::size_t done = full_height ? means_of_row(image, by, whole, out) : 0;
        for (; done < width; ++done) out[done] = edge_block_mean(image, static_cast<int>(done), by);
    }
    return grid;
}

LumaSums luma_sums(const ImageView& image, int row_step) {
    RIG_CHECK(is_processable(image) && row_step > 0);
    constexpr std::size_t kRoom = 255 * kLanes;  // pixels whose saturated ones a byte can count
    LumaSums sums;
    const auto width = static_cast<std::size_t>(image.width_px);
    for (int y = 0; y < image.height_px; y += row_step) {
        const std::uint8_t* pixels = image.row(y);
        std::size_t x = 0;
        while (x + kLanes <= width) {
            std::uint32_t sum = 0;
            SixteenBytes saturated{};
            for (const std::size_t end = std::min(width, x + kRoom); x + kLanes <= end; x += kLanes) {
                const SixteenBytes v = load_bytes(pixels + x);
                sum += sum_of_bytes(v);
                saturated -= reinterpret_cast<SixteenBytes>(v == SixteenBytes{} + 255);
            }
            sums.sum += sum, sums.saturated += sum_of_bytes(saturated);
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

void step_levels(const BlockGrid& grid, Side side, int least, int part) {
    RIG_CHECK(least >= 0 && least <= 255 && part >= 0 && part <= 256);
    const auto share = static_cast<std::uint16_t>(part);
    const SixteenBytes smallest = SixteenBytes{} + static_cast<std::uint8_t>(least);
    const SixteenBytes highest = SixteenBytes{} + 250;
    const auto parts = [share](const std::uint8_t* levels) {
        return reinterpret_cast<PixelLanes>(reinterpret_cast<EightSums>(load_pixels(levels, 0)) * share >> 8);
    };
    const auto stepped = [&](const std::uint8_t* levels) {
        const SixteenBytes level = load_bytes(levels);
        const SixteenBytes of_level = bytes_of_lanes(parts(levels), parts(levels + kPixelLanes));
        const SixteenBytes step = of_level > smallest ? of_level : smallest;
        if (side == Side::kBelow) return level - (level < step ? level : step);
        const SixteenBytes room = ~level;
        const SixteenBytes raised = level + (room < step ? room : step);
        return raised < highest ? raised : highest;
    };
    const std::size_t count = grid.values.size();
    std::size_t i = 0;
    for (; i + kLanes <= count; i += kLanes) store_bytes(stepped(&grid.values[i]), &grid.values[i]);
    if (i < count) {
        auto rest = last_pixels(&grid.values[i], count - i);
        store_bytes(stepped(rest.data()), rest.data());
        std::memcpy(&grid.values[i], rest.data(), count - i);
    }
}

std::size_t threshold_runs(const ImageView& image, const BlockGrid& thresholds, Side side,
                           std::span<Run> runs, bool& truncated) {
    RIG_CHECK(is_processable(image));
    RIG_CHECK(thresholds.width == blocks_across(image.width_px) &&
              thresholds.height == blocks_across(image.height_px));
    truncated = false;
    const auto width = static_cast<std::size_t>(image.width_px);
    const auto words = (width + kWordPx - 1) / kWordPx;
    // The last two rows of the blocks before, the rows of these: all but the last have both neighbours.
    std::array<RowWords, kBlock + 2> rows;
    for (RowWords& row : rows) std::fill_n(row.begin(), words, std::uint64_t{0});
    std::size_t count = 0;
    for (int top = 0; top <= image.height_px; top += kBlock) {
        if (top < image.height_px) mark_beyond(image, thresholds, side, top / kBlock, &rows[2]);
        for (int r = std::max(0, image.height_px - top); r < kBlock; ++r)
            std::fill_n(rows[static_cast<std::size_t>(r) + 2].begin(), words, std::uint64_t{0});
        for (int r = 0; r < kBlock; ++r) {
            const int y = top + r - 1;
            if (y < 0 || y >= image.height_px) continue;
            if (runs.size() - count < width / 2 + 1) {  // the most runs a row can have
                truncated = true;
                return count;
            }
            count += runs_of_row(&rows[static_cast<std::size_t>(r) + 1], width, y, &runs[count]);
        }
        std::copy_n(rows[kBlock].begin(), words, rows[0].begin());
        std::copy_n(rows[kBlock + 1].begin(), words, rows[1].begin());
    }
    return count;
}

void threshold_bits(const ImageView& image, const BlockGrid& thresholds, Side side,
                    std::span<std::uint64_t> rows) {
    RIG_CHECK(is_processable(image) && image.width_px <= static_cast<int>(kWordPx));
    RIG_CHECK(thresholds.width == blocks_across(image.width_px) &&
              thresholds.height == blocks_across(image.height_px));
    RIG_CHECK(rows.size() >= static_cast<std::size_t>(image.height_px));
    std::array<RowWords, kBlock> words;
    for (int y = 0; y < image.height_px; ++y) {
        if (y % kBlock == 0) mark_beyond(image, thresholds, side, y / kBlock, words.data());
        rows[static_cast<std::size_t>(y)] = words[static_cast<std::size_t>(y % kBlock)][0];
    }
}

}  // namespace rig
