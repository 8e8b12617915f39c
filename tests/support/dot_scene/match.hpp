// Compares what was seen with what was there.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/detect/observation.hpp"

namespace rig::test {

struct TrueDot {
    double x_px = 0.0;
    double y_px = 0.0;
    double reach_px = 3.0;  // a sighting within this distance is of this dot
    bool expected = true;   // false: may be found, need not be
};

struct SeenDot {
    double x_px = 0.0;
    double y_px = 0.0;
};

// Counts add up over pictures with +=.
struct MatchCounts {
    std::size_t expected = 0;  // dots that should be found
    std::size_t expected_found = 0;
    std::size_t seen = 0;
    std::size_t right = 0;          // sightings of a dot, expected or not; each dot once
    double square_error_px2 = 0.0;  // sum over `right`
    double largest_error_px = 0.0;

    MatchCounts& operator+=(const MatchCounts& other);
    [[nodiscard]] double recall() const;
    [[nodiscard]] double precision() const;
    [[nodiscard]] double rms_px() const;
};

// Every dot takes its nearest free sighting within reach, dots in order.
[[nodiscard]] MatchCounts match(std::span<const TrueDot> truth, std::span<const SeenDot> seen);

[[nodiscard]] std::vector<SeenDot> seen_dots(const Observations& observations);

}  // namespace rig::test
