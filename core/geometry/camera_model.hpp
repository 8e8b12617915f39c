// A calibrated camera: pinhole with radial and tangential distortion, fixed to the headset.
#pragma once

#include "core/base/linalg.hpp"

namespace rig {

// p = (X, Y) / Z in camera axes (x right, y down, z forward), r2 = |p|^2;
// p_d = p (1 + k1 r2 + k2 r2^2 + k3 r2^3) + tangential(p1, p2); pixel = f * p_d + c.  (Brown-Conrady)
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

// Unit direction, headset frame, of the ray through a distorted pixel. Fixed iteration count.
[[nodiscard]] Vec3 pixel_ray(const CameraModel& camera, const Vec2& pixel);

}  // namespace rig
