// Where several sightings of one marker meet, and how well that is known.
#pragma once

#include <span>

#include "core/base/linalg.hpp"

namespace rig {

// One sighting of a marker, headset frame. From a camera: any point of the ray, its unit direction, and the
// inverse variance across it. From a 3D stream: the point itself and direction zero.
struct Sighting {
    Vec3 point_mm = Vec3::Zero();
    Vec3 direction = Vec3::Zero();
    double information = 1.0;  // 1/mm^2 across the ray (or in every direction, for a point)

    // Projector onto what the sighting measures: I - d d^T, or I for a point.
    [[nodiscard]] Mat3 projector() const { return Mat3::Identity() - direction * direction.transpose(); }

    // Squared distance of `x_mm` from the ray or point, mm^2.
    [[nodiscard]] double squared_distance_mm2(const Vec3& x_mm) const {
        const Vec3 q = x_mm - point_mm;
        const double along = q.dot(direction);
        return q.dot(q) - along * along;
    }
};

struct Triangulation {
    Vec3 position_mm = Vec3::Zero();
    Mat3 information = Mat3::Zero();  // 1/mm^2; what the sightings alone say
    double gap_mm = 0.0;              // largest distance of a sighting from the position
};

// Weighted least squares over sightings. Directions in which they say little (one ray; nearly parallel rays)
// are taken from `expected_mm` by a prior of `prior_information` (1/mm^2), which is not counted in
// `information`. Precondition: sightings not empty, all numbers finite.
[[nodiscard]] Triangulation triangulate(std::span<const Sighting> sightings, const Vec3& expected_mm,
                                        double prior_information);

// Inverse of a symmetric positive definite 3x3 matrix by cofactors.
[[nodiscard]] Mat3 inverse_3x3(const Mat3& a);

}  // namespace rig
