// What the markers of one image have in common, and how odd a blob is among them: markers are of one make, so
// their long axes, the ink's or the paint's depth and the sharpness of their edges agree. Not for: blobs
// alone (blob_shape), or images with too few markers to say anything.
#pragma once

#include <cstddef>
#include <span>

#include "core/detect/blob.hpp"
#include "core/image/kernels.hpp"

namespace rig {

// Medians over the sure markers of an image, and their spreads: 1.5 times the median distance from the
// median, which is the standard deviation of a normal distribution. All 0 when the markers are too few.
struct Population {
    double size_px = 0.0;      // long axis
    double size_spread = 0.0;  // relative to size_px
    double depth = 0.0;
    double depth_spread = 0.0;  // relative to depth, of markers wide enough to show all of it
    double edge_px2 = 0.0;      // edge_square_px2()
    double slope = 0.0;         // edge_slope() of dark markers wide enough to have one; 0: unknown
    double slope_spread = 0.0;  // relative to slope
};

struct PopulationLimits {
    double size_ratio = 1.5;   // long axis / median, or median / long axis: one unit of badness
    double ink_spread = 0.75;  // part of the expected depth that a dark marker may lack: one unit of badness;
    double retro_spread = 1.6;  // of a bright one, whose return falls with the angle
    std::size_t quorum = 8;     // markers needed before their medians say anything
};

// Square of an edge's width, px^2, up to a factor: what the axes of equal moments enclose beyond the area.
// About 16 variances of the lens, whatever the size and the shape.
[[nodiscard]] double edge_square_px2(const Blob& blob);

// Narrower ones have no edge of their own behind the lens.
inline constexpr double kLeastSlopeWidthPx = 4.3;

// 0..1: part of its depth that a marker `short_axis_px` across shows at its core, the lens being what it is.
[[nodiscard]] double shown_depth(double short_axis_px, double edge_px2);

[[nodiscard]] Population population_of(std::span<const Blob> blobs, std::size_t quorum);

// In units of badness; 0 for a blob like the others, or when there is no population.
[[nodiscard]] double oddness(const Population& population, const PopulationLimits& limits, Side side,
                             const Blob& blob);

}  // namespace rig
