// What is summed over pixels of a blob's window, whole vectors at a time; integers, so that order is free.
// Not for: what the sums mean.
#pragma once

#include <cstdint>

#include "core/detect/bit_rows.hpp"
#include "core/detect/blob.hpp"
#include "core/image/pixel_lanes.hpp"

namespace rig {

// Of row y, the pixels from `left` to `right` whose cover is at least `least`; bits outside them mean
// nothing.
[[nodiscard]] inline std::uint64_t covered_bits(const BlobWorkspace& w, int y, int left, int right,
                                                int least) {
    const std::int16_t* cover = w.cover[static_cast<std::size_t>(y)].data();
    const PixelLanes under = all_lanes(least - 1);
    std::uint64_t bits = 0;
    for (int x = left; x < right; x += kByteLanes) {
        PixelLanes two[2];
        std::memcpy(two, cover + x, sizeof(two));
        bits |= std::uint64_t{bits_of_bytes(bytes_of_masks(two[0] > under, two[1] > under))} << x;
    }
    return bits;
}

// The grey level that `percent` of the marked pixels lie below or at; 0 for an empty set. box: around them.
[[nodiscard]] int percentile(const BlobWorkspace& workspace, const BitRows& marked, const BitBox& box,
                             int percent);

// Grey levels in 1/256 (fixed point): lowest + slope_x x + slope_y y, and what is at most `reach` above it.
struct LevelBand {
    int lowest = 0;
    int slope_x = 0;
    int slope_y = 0;
    int reach = 0;
};

inline constexpr int kLevelFraction = 256;

// Over pixels: their number, and sums of coordinates x, y and grey levels v.
struct PlaneSums {
    std::int64_t n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, v = 0, xv = 0, yv = 0, vv = 0;
};

// Of the marked pixels whose grey level is in the band. Coordinates from (centre_x, centre_y), which is
// within 32 px of each of them. box: around them.
[[nodiscard]] PlaneSums sum_in_band(const BlobWorkspace& workspace, const BitRows& marked, const BitBox& box,
                                    const LevelBand& band, int centre_x, int centre_y);

// Sums of weights w, and of w times coordinates from the corner of a box.
struct WeightSums {
    std::int64_t w = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
};

// Weights rise from 0 to 2 ramp with the cover, from `outline` - ramp to `outline` + ramp; pixels of `rim`
// have at least half of that and those of `inner` all, whatever covers them. box: around `region`, which
// holds both.
[[nodiscard]] WeightSums sum_weights(const BlobWorkspace& workspace, const BitRows& region,
                                     const BitRows& rim, const BitRows& inner, const BitBox& box, int outline,
                                     int ramp);

}  // namespace rig
