// Where the picture of a painted disc lies about the picture of its middle. A detector measures the first, a
// solver means the second; on tilted, round skin close to the camera they are a few hundredths of a pixel
// apart. Not for: detection, which knows neither tilt nor distance.
#pragma once

#include "core/base/linalg.hpp"

namespace rig {

struct SkinDisc {
    Vec3 centre_mm = Vec3::Zero();  // camera axes: x right, y down, z forward
    Vec3 normal = Vec3::Zero();     // unit, out of the skin
    double radius_mm = 0.0;         // along the skin
    double curvature_per_mm = 0.0;  // 1 / radius of the skin, positive where it is convex
};

// Centroid of the disc's picture minus the picture of its centre, in normalised image coordinates (x / z):
// times the focal length, in pixels. Quadrature over 24 points of the disc, each weighted by the image area
// that its skin takes: -(m . p) / z^3. Zero when part of the disc faces away, or is not in front of the
// camera.
[[nodiscard]] Vec2 disc_centroid_offset(const SkinDisc& disc);

}  // namespace rig
