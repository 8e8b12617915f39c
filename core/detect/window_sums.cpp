#include "core/detect/window_sums.hpp"

#include <algorithm>
#include <cstring>

#include "core/detect/row_weights.hpp"

namespace rig {

namespace {

using FourWords = std::uint32_t __attribute__((vector_size(16)));

constexpr std::size_t kVectors = kBlobWindowPx * kBlobWindowPx / kByteLanes;

// Bytes that are no greater than `level`.
std::uint32_t count_up_to(const SixteenBytes* bytes, std::size_t vectors, int level) {
    constexpr std::size_t kRoom = 255;  // counts that a byte holds
    const SixteenBytes levels = SixteenBytes{} + static_cast<std::uint8_t>(level);
    std::uint32_t count = 0;
    for (std::size_t first = 0; first < vectors; first += kRoom) {
        SixteenBytes counts{};
        for (std::size_t i = first; i < std::min(vectors, first + kRoom); ++i) {
            const SixteenBytes least = bytes[i] < levels ? bytes[i] : levels;
            counts -= reinterpret_cast<SixteenBytes>(least == bytes[i]);
        }
        count += sum_of_bytes(counts);
    }
    return count;
}

// Sums over the rows for eight columns.
struct PlaneLanes {
    PixelLanes n{}, y{}, yy{}, v{};
    FourInts yv{}, vv{};
};

// Those of all columns.
class PlaneTotals {
  public:
    void add(const PlaneLanes& of, PixelLanes x) {
        const PixelLanes one = all_lanes(1);
        const PixelLanes nx = of.n * x;
        n_ += of.n, x_ += nx, y_ += of.y;
        xx_ += products_of_pairs(nx, x), xy_ += products_of_pairs(of.y, x);
        yy_ += products_of_pairs(of.yy, one), v_ += products_of_pairs(of.v, one);
        xv_ += products_of_pairs(of.v, x), yv_ += of.yv, vv_ += of.vv;
    }
    [[nodiscard]] PlaneSums sums() const {
        return {sum_of_lanes(n_), sum_of_lanes(x_), sum_of_lanes(y_), sum_of_ints(xx_), sum_of_ints(xy_),
                sum_of_ints(yy_), sum_of_ints(v_),  sum_of_ints(xv_), sum_of_ints(yv_), sum_of_ints(vv_)};
    }

  private:
    PixelLanes n_{}, x_{}, y_{};
    FourInts xx_{}, xy_{}, yy_{}, v_{}, xv_{}, yv_{}, vv_{};
};

// 256 times the grey levels of eight pixels.
struct EightWords {
    FourWords low;
    FourWords high;
};

EightWords times_fraction(PixelLanes v) {
    const auto high_bytes = reinterpret_cast<EightSums>(v) << 8;
    const EightSums none{};
    return {
        reinterpret_cast<FourWords>(__builtin_shufflevector(high_bytes, none, 0, 8, 1, 9, 2, 10, 3, 11)),
        reinterpret_cast<FourWords>(__builtin_shufflevector(high_bytes, none, 4, 12, 5, 13, 6, 14, 7, 15))};
}

// Eight columns from `left` on.
PlaneLanes sum_columns(const BlobWorkspace& w, const BitRows& marked, const BitBox& box, int left,
                       const LevelBand& band, int centre_y) {
    // Unsigned comparison by a signed one: both sides lose 2^31.
    constexpr std::uint32_t kTop = 0x80000000U;
    const auto slope = static_cast<std::uint32_t>(band.slope_x);
    const std::uint32_t first = slope * static_cast<std::uint32_t>(left);
    const FourWords low{first, first + slope, first + 2 * slope, first + 3 * slope};
    const FourWords high = low + 4 * slope;
    const auto most =
        reinterpret_cast<FourInts>(FourWords{} + (static_cast<std::uint32_t>(band.reach) - kTop));
    PlaneLanes lanes;
    PixelLanes at = all_lanes(box.top - 1 - centre_y);
    for (int py = box.top; py < box.bottom; ++py) {
        at += 1;
        const std::uint64_t bits = marked[static_cast<std::size_t>(py)] >> left & 0xFFU;
        if (bits == 0) continue;
        const std::uint32_t row = static_cast<std::uint32_t>(band.lowest) +
                                  static_cast<std::uint32_t>(band.slope_y * (py - centre_y)) + kTop;
        const PixelLanes v = load_pixels(w.values[static_cast<std::size_t>(py)].data() + left, 0);
        const EightWords level = times_fraction(v);
        const EightInts over{reinterpret_cast<FourInts>(level.low - (low + row)) > most,
                             reinterpret_cast<FourInts>(level.high - (high + row)) > most};
        const PixelLanes keep = lanes_of_bits(bits) & ~lanes_of_ints(over);
        const PixelLanes kept = v & keep;
        const PixelLanes kept_at = at & keep;
        lanes.n -= keep;
        lanes.y += kept_at;
        lanes.yy += kept_at * at;
        lanes.v += kept;
        lanes.yv += products_of_pairs(kept, at);
        lanes.vv += products_of_pairs(kept, kept);
    }
    return lanes;
}

std::int64_t sum_of(FourInts v) {
    return (std::int64_t{v[0]} + v[1]) + (std::int64_t{v[2]} + v[3]);
}

// Sum of v[i] (first + i); v is below 2^31 / 2^6.
std::int64_t sum_across(FourInts v, std::int64_t first) {
    return (v[0] * first + v[1] * (first + 1)) + (v[2] * (first + 2) + v[3] * (first + 3));
}

}  // namespace

int percentile(const BlobWorkspace& w, const BitRows& marked, const BitBox& box, int percent) {
    std::array<SixteenBytes, kVectors> picked;  // the marked ones; others are 255
    std::size_t vectors = 0;
    std::uint32_t count = 0;
    for (int y = box.top; y < box.bottom; ++y) {
        const auto row = static_cast<std::size_t>(y);
        if (marked[row] == 0) continue;
        count += static_cast<std::uint32_t>(ones(marked[row]));
        for (int x = box.left; x < box.right; x += kByteLanes) {
            picked[vectors++] = load_bytes(w.values[row].data() + x) | ~bytes_of_bits(marked[row] >> x);
        }
    }
    if (count == 0) return 0;
    const std::uint32_t rank = count * static_cast<std::uint32_t>(percent) / 100;
    int level = 0;
    for (int bit = 128; bit > 0; bit /= 2) {
        if (count_up_to(picked.data(), vectors, level + bit - 1) <= rank) level += bit;
    }
    return level;
}

PlaneSums sum_in_band(const BlobWorkspace& w, const BitRows& marked, const BitBox& box, const LevelBand& band,
                      int centre_x, int centre_y) {
    PlaneTotals totals;
    LevelBand from_column = band;
    from_column.lowest = band.lowest - band.slope_x * centre_x;
    for (int left = box.left; left < box.right; left += kPixelLanes) {
        totals.add(sum_columns(w, marked, box, left, from_column, centre_y), counting_lanes(left - centre_x));
    }
    return totals.sums();
}

WeightSums sum_weights(const BlobWorkspace& w, const BitRows& region, const BitRows& rim,
                       const BitRows& inner, const BitBox& box, int outline, int ramp) {
    const PixelLanes low = all_lanes(outline - ramp);
    const PixelLanes most = all_lanes(2 * ramp);
    const PixelLanes half = all_lanes(ramp);
    WeightSums sums;
    for (int left = box.left; left < box.right; left += kPixelLanes) {
        WeightLanes lanes;
        for (int y = box.top; y < box.bottom; ++y) {
            const auto row = static_cast<std::size_t>(y);
            PixelLanes cover;
            std::memcpy(&cover, &w.cover[row][static_cast<std::size_t>(left)], sizeof(cover));
            const PixelLanes whole = lanes_of_bits(inner[row] >> left);
            const PixelLanes least = (lanes_of_bits(rim[row] >> left) & ~whole & half) | (whole & most);
            const PixelLanes over = cover - low;
            const PixelLanes raised = over > least ? over : least;
            const PixelLanes weight = raised < most ? raised : most;
            lanes.add(weight & lanes_of_bits(region[row] >> left));
        }
        // Rows were added with the rows left, h - y, and half of (h - y)(h - y + 1).
        const std::int64_t h = box.bottom - box.top;
        const auto [low_sum, high_sum] = ints_of_lanes(lanes.sum);
        const auto add = [&](FourInts once, FourInts rows, FourInts twice, std::int64_t x) {
            const std::int64_t all = sum_of(once);
            const std::int64_t across = sum_across(once, x);
            sums.w += all;
            sums.x += across;
            sums.xx += (once[0] * x * x + once[1] * (x + 1) * (x + 1)) +
                       (once[2] * (x + 2) * (x + 2) + once[3] * (x + 3) * (x + 3));
            const std::int64_t left_rows = sum_of(rows);
            sums.y += h * all - left_rows;
            sums.xy += h * across - sum_across(rows, x);
            sums.yy += h * h * all - 2 * h * left_rows + 2 * sum_of(twice) - left_rows;
        };
        const std::int64_t x = left - box.left;
        add(low_sum, lanes.low, lanes.low_twice, x);
        add(high_sum, lanes.high, lanes.high_twice, x + 4);
    }
    return sums;
}

}  // namespace rig
