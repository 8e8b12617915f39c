// A calibrated camera: its lens, where it sits on the headset, and when its rows are exposed.
#pragma once

#include <cstdint>

#include "core/base/linalg.hpp"

namespace rig {

// x, y = X / Z, Y / Z in camera axes (x right, y down, z forward); pixel = f * p_d + c.
enum class LensModel : std::uint8_t {
    // Brown-Conrady, rational: r2 = x^2 + y^2,
    // p_d = p (1 + k1 r2 + k2 r2^2 + k3 r2^3) / (1 + k4 r2 + k5 r2^2 + k6 r2^3) + tangential(p1, p2).
    // k4 = k5 = k6 = 0 is the polynomial model. OpenCV's order of the same numbers: k1 k2 p1 p2 k3 k4 k5 k6.
    kRational = 0,
    // Equidistant fisheye (Kannala and Brandt 2006, radial part): theta = angle from the optical axis,
    // |p_d| = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8). p1, p2, k5, k6 are 0.
    kFisheye = 1,
};

struct CameraModel {
    int width_px = 0;
    int height_px = 0;
    double fx_px = 0.0;
    double fy_px = 0.0;
    double cx_px = 0.0;
    double cy_px = 0.0;
    double k1 = 0.0;
    double k2 = 0.0;
    double p1 = 0.0;
    double p2 = 0.0;
    double k3 = 0.0;
    double k4 = 0.0;
    double k5 = 0.0;
    double k6 = 0.0;
    LensModel lens = LensModel::kRational;
    double row_time_us = 0.0;  // from one row's exposure to that of the row below; 0: global shutter
    Mat3 camera_from_headset = Mat3::Identity();  // rotation only: X_cam = R (X_headset - centre)
    Vec3 centre_mm = Vec3::Zero();                // optical centre in the headset frame
};

// Pixel of a headset-frame point; z_mm is the depth along the optical axis (a point with z_mm <= 0 is
// behind).
struct Projection {
    Vec2 pixel = Vec2::Zero();
    double z_mm = 0.0;
};

[[nodiscard]] Projection project(const CameraModel& camera, const Vec3& headset_point_mm);
// The same of a point in camera axes.
[[nodiscard]] Projection project_in_camera(const CameraModel& camera, const Vec3& camera_point_mm);

// Slope of that pixel along camera coordinates, px/mm. Precondition: camera_point_mm[2] > 0.
using PixelSlope = Eigen::Matrix<double, 2, 3>;
[[nodiscard]] PixelSlope pixel_slope_in_camera(const CameraModel& camera, const Vec3& camera_point_mm);

// Unit direction, headset frame, of the ray through a distorted pixel. Fixed iteration count. Within 1e-8 px
// of the pixel wherever the lens model rises; where it folds, the direction is finite and means nothing.
[[nodiscard]] Vec3 pixel_ray(const CameraModel& camera, const Vec2& pixel);

// How much later than the frame's capture time a row was exposed, microseconds, negative above the middle.
// The frame's capture time is mid-exposure of its middle row, so that the rows' mean is the frame's own time.
[[nodiscard]] double row_delay_us(const CameraModel& camera, double y_px);

}  // namespace rig
