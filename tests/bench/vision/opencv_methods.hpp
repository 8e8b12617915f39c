// What one would write with OpenCV in an afternoon: the methods that detection has to beat. Polarity is
// handed to them.
#pragma once

#include <cstddef>
#include <vector>

#include "core/image/view.hpp"
#include "tests/support/dot_scene/match.hpp"

namespace rig::bench {

inline constexpr double kLeastArea = 10.0;  // px, of a marker, for all of them
inline constexpr double kMostArea = 500.0;

[[nodiscard]] std::vector<test::SeenDot> simple_blob_detector(const ImageView& image, bool bright);
inline constexpr double kUsualStep = 12.0;  // grey levels from the mean around

// Adaptive threshold, outlines with area and circularity, centre by moments of the outline.
[[nodiscard]] std::vector<test::SeenDot> threshold_contours(const ImageView& image, bool bright,
                                                            double step = kUsualStep);
// Adaptive threshold, components with area, extent and aspect, plain centroid.
[[nodiscard]] std::vector<test::SeenDot> threshold_components(const ImageView& image, bool bright);
// One comparison per pixel and a count: the least that any detector does. Sees nothing.
[[nodiscard]] std::size_t threshold_count(const ImageView& image, bool bright);

void use_one_thread();

}  // namespace rig::bench
