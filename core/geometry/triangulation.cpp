#include "core/geometry/triangulation.hpp"

#include <cmath>

#include "core/base/check.hpp"
#include "core/base/math.hpp"

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

double measured_length_mm(const Mat3& information, const Vec3& difference_mm) {
    const double trace = information.trace();
    if (!(trace > 0.0)) return 0.0;
    const Vec3 weighted = information * difference_mm;
    return std::sqrt(difference_mm.dot(weighted) * 3.0 / trace);
}

bool covariance_from_information(const Mat3& information, double most_sigma_mm, Mat3& covariance_mm2) {
    const Mat3 inverse = inverse_3x3(information);
    double largest = 0.0;
    for (int i = 0; i < 9; ++i) {
        if (!is_finite(inverse(i / 3, i % 3))) return false;
    }
    for (int i = 0; i < 3; ++i) {
        if (!(inverse(i, i) > 0.0)) return false;
        if (inverse(i, i) > largest) largest = inverse(i, i);
    }
    if (largest > most_sigma_mm * most_sigma_mm) return false;
    covariance_mm2 = inverse;
    return true;
}

namespace {

constexpr int kPointSteps = 6;
constexpr double kLeastDepthMm = 1.0;

// Least squares over the rays; the start. Cameras see about alike, so every ray counts the same.
bool meet_of_rays(std::span<const PixelSighting> sightings, Vec3& position_mm) {
    Mat3 system = Mat3::Zero();
    Vec3 right = Vec3::Zero();
    const Vec3 origin = sightings[0].camera->centre_mm;
    for (const PixelSighting& each : sightings) {
        const Vec3 direction = pixel_ray(*each.camera, each.pixel);
        const Mat3 across = Mat3::Identity() - direction * direction.transpose();
        system += across;
        right += across * (each.camera->centre_mm - origin);
    }
    Mat3 inverse;
    // Half a degree between two rays leaves 4e-5 of a unit of information: a sigma of 160.
    if (!covariance_from_information(system, 500.0, inverse)) return false;
    const Vec3 offset = inverse * right;
    position_mm = origin + offset;
    return true;
}

// Information, right-hand side and squared error at a position; false when a camera has it behind itself.
struct PointSums {
    Mat3 information = Mat3::Zero();
    Vec3 right = Vec3::Zero();
    double squared_px = 0.0;
};

bool sum_up(std::span<const PixelSighting> sightings, const Vec3& position_mm, PointSums& sums) {
    sums = PointSums{};
    for (const PixelSighting& each : sightings) {
        const CameraModel& camera = *each.camera;
        const Vec3 at = camera.camera_from_headset * (position_mm - camera.centre_mm);
        if (!(at[2] > kLeastDepthMm)) return false;
        const PixelSlope slope = pixel_slope_in_camera(camera, at) * camera.camera_from_headset;
        const Vec2 error = each.pixel - project_in_camera(camera, at).pixel;
        const double weight = 1.0 / (each.sigma_px * each.sigma_px);
        const Mat3 information = slope.transpose() * slope;
        const Vec3 right = slope.transpose() * error;
        sums.information += weight * information;
        sums.right += weight * right;
        sums.squared_px += error.dot(error);
    }
    return true;
}

}  // namespace

PointFit triangulate_pixels(std::span<const PixelSighting> sightings) {
    PointFit fit;
    if (sightings.size() < 2 || !meet_of_rays(sightings, fit.position_mm)) return fit;
    PointSums sums;
    constexpr double kMostSigmaMm = 1e3;
    for (int step = 0; step < kPointSteps; ++step) {
        if (!sum_up(sightings, fit.position_mm, sums)) return fit;
        if (!covariance_from_information(sums.information, kMostSigmaMm, fit.covariance_mm2)) return fit;
        const Vec3 move = fit.covariance_mm2 * sums.right;
        fit.position_mm += move;
    }
    if (!sum_up(sightings, fit.position_mm, sums)) return fit;
    fit.information = sums.information;
    fit.rms_px = std::sqrt(sums.squared_px / static_cast<double>(sightings.size()));
    fit.known = covariance_from_information(sums.information, kMostSigmaMm, fit.covariance_mm2);
    return fit;
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
