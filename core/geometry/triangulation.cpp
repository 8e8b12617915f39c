#include "core/geometry/triangulation.hpp"

#include <cmath>

#include "core/base/check.hpp"

namespace rig {

Mat3 inverse_3x3(const Mat3& a) {
    const Vec3 c0 = a.col(0);
    const Vec3 c1 = a.col(1);
    const Vec3 c2 = a.col(2);
    const Vec3 r0 = c1.cross(c2);
    const Vec3 r1 = c2.cross(c0);
    const Vec3 r2 = c0.cross(c1);
    const double determinant = c0.dot(r0);
    Mat3 inverse;
    inverse.row(0) = r0.transpose() / determinant;
    inverse.row(1) = r1.transpose() / determinant;
    inverse.row(2) = r2.transpose() / determinant;
    return inverse;
}

Triangulation triangulate(std::span<const Sighting> sightings, const Vec3& expected_mm,
                          double prior_information) {
    RIG_CHECK(!sightings.empty());
    Triangulation result;
    // Relative to the expected position the sums stay small and well scaled.
    Vec3 right = Vec3::Zero();
    for (const Sighting& sighting : sightings) {
        const Mat3 a = sighting.information * sighting.projector();
        result.information += a;
        right += a * (sighting.point_mm - expected_mm);
    }
    const Mat3 system = result.information + prior_information * Mat3::Identity();
    const Vec3 offset = inverse_3x3(system) * right;
    result.position_mm = expected_mm + offset;
    double worst = 0.0;
    for (const Sighting& sighting : sightings) {
        const double d2 = sighting.squared_distance_mm2(result.position_mm);
        if (d2 > worst) worst = d2;
    }
    result.gap_mm = std::sqrt(worst);
    return result;
}

}  // namespace rig
