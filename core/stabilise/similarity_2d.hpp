// Takes head motion out of 2D markers from one camera: the similarity (scale, turn, shift) between their
// neutral positions and where they are seen [Zhang06 eq. 8-9]. For streams that never were three-dimensional;
// a camera with a calibration belongs to the stabiliser. Not for: perspective, which a similarity cannot
// follow, and an affine fit follows worse (it takes expression for motion).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/linalg.hpp"
#include "core/limits.hpp"

namespace rig {

// seen = [a -b; b a] neutral + shift; a = scale cos, b = scale sin. In the units of the stream (pixels).
struct Similarity2d {
    double a = 1.0;
    double b = 0.0;
    Vec2 shift = Vec2::Zero();

    [[nodiscard]] Vec2 apply(const Vec2& neutral) const {
        return Vec2{a * neutral[0] - b * neutral[1], b * neutral[0] + a * neutral[1]} + shift;
    }
    // Of a similarity with a scale above 0.
    [[nodiscard]] Vec2 apply_inverse(const Vec2& seen) const {
        const Vec2 d = seen - shift;
        return Vec2{a * d[0] + b * d[1], a * d[1] - b * d[0]} / (a * a + b * b);
    }
    [[nodiscard]] double scale() const;
    [[nodiscard]] double turn_rad() const;
};

// One marker: where it is on the neutral face, where it was seen, and how much it counts; 0 or less, or a
// coordinate that is not finite: not seen.
struct PlanarMarker {
    Vec2 neutral = Vec2::Zero();
    Vec2 seen = Vec2::Zero();
    double weight = 1.0;  // at most 1e12
};

struct Similarity2dConfig {
    // Markers farther off than this many times the typical distance count less and less.
    double outlier_spreads = 2.5;
    double least_spread = 0.2;  // of the typical distance: the noise of a detected centre
};

struct Similarity2dReport {
    bool ok = false;            // false: fewer than two places were seen; the identity is returned
    std::uint16_t used = 0;     // markers seen
    std::uint16_t doubted = 0;  // ... that count less than half
    double spread = 0.0;        // weighted rms distance of what is believed, over both coordinates together
};

// Weighted least squares in closed form, repeated eight times with the weights of Geman and McClure about the
// median distance. At most kMaxMarkers markers; coordinates within 1e6. About 60 operations a marker and
// round.
[[nodiscard]] Similarity2d fit_similarity_2d(std::span<const PlanarMarker> markers,
                                             const Similarity2dConfig& config, Similarity2dReport& report);

}  // namespace rig
