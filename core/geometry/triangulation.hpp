// Where several sightings of one marker meet, and how well that is known.
#pragma once

#include <span>

#include "core/base/linalg.hpp"
#include "core/geometry/camera_model.hpp"

namespace rig {

// One sighting of a marker, headset frame. From a camera: any point of the ray, its unit direction, and the
// inverse variance across it. From a 3D stream: the point itself and direction zero.
struct Sighting {
    Vec3 point_mm = Vec3::Zero();
    Vec3 direction = Vec3::Zero();
    double information = 1.0;  // 1/mm^2 across the ray (or in every direction, for a point)
    double delay_us = 0.0;  // exposed that much after the frame's capture time: its row of a rolling shutter

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

// Length of a difference in the directions that were measured: as if every one were known as well as these
// on average. 0 where nothing is known.
[[nodiscard]] double measured_length_mm(const Mat3& information, const Vec3& difference_mm);

// Covariance of a position, mm^2, from its information. Nothing (false) where the sightings leave a direction
// open: one ray, or rays so nearly parallel that a standard deviation exceeds most_sigma_mm.
[[nodiscard]] bool covariance_from_information(const Mat3& information, double most_sigma_mm,
                                               Mat3& covariance_mm2);

// One camera's pixel of a point; both axes with the same standard deviation.
struct PixelSighting {
    const CameraModel* camera = nullptr;
    Vec2 pixel = Vec2::Zero();
    double sigma_px = 1.0;
};

struct PointFit {
    Vec3 position_mm = Vec3::Zero();     // headset frame
    Mat3 information = Mat3::Zero();     // 1/mm^2
    Mat3 covariance_mm2 = Mat3::Zero();  // valid when known
    double rms_px = 0.0;                 // of the distance of seen from projected pixels
    bool known = false;  // false: fewer than two views, rays nearly parallel, or the point is behind a camera
};

// N views of one point: the position of least squared reprojection error, in units of each sighting's sigma
// (maximum likelihood for Gaussian pixels; Hartley and Sturm 1997), from the linear answer by six
// Gauss-Newton steps. Its covariance holds for errors small against the distance. Any finite pixels are safe.
[[nodiscard]] PointFit triangulate_pixels(std::span<const PixelSighting> sightings);

// Inverse of a symmetric positive definite 3x3 matrix by cofactors.
[[nodiscard]] Mat3 inverse_3x3(const Mat3& a);

}  // namespace rig
