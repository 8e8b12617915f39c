// Moments of weights that come row by row, eight columns at a time. Not for: more than 64 rows.
#pragma once

#include "core/image/pixel_lanes.hpp"

namespace rig {

// Weights of eight columns, summed over rows: once, weighted with the rows left, and with half their squares.
// Each weight at most 511, and the sum of a column within 16 bits.
struct WeightLanes {
    PixelLanes sum{};
    FourInts low{}, high{};
    FourInts low_twice{}, high_twice{};

    void add(PixelLanes weight) {
        sum += weight;
        const auto [a, b] = ints_of_lanes(sum);
        low += a, high += b;
        low_twice += low, high_twice += high;
    }
};

}  // namespace rig
