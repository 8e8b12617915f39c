#include "core/geometry/camera_model.hpp"

#include <cmath>

namespace rig {

namespace {

constexpr int kUndistortSteps = 12;  // Newton; a lens of 75 degrees with k1 = -0.3 needs 6 for 1e-9 px
constexpr double kFoldDeterminant =
    0.05;  // under it the pixel lies where the lens model folds: no Newton step there

Vec2 distort(const CameraModel& camera, const Vec2& p) {
    const double r2 = p.dot(p);
    const double radial = 1.0 + r2 * (camera.k1 + r2 * (camera.k2 + r2 * camera.k3));
    const double xy = p[0] * p[1];
    return {p[0] * radial + 2.0 * camera.p1 * xy + camera.p2 * (r2 + 2.0 * p[0] * p[0]),
            p[1] * radial + camera.p1 * (r2 + 2.0 * p[1] * p[1]) + 2.0 * camera.p2 * xy};
}

Mat2 distortion_slope(const CameraModel& camera, const Vec2& p) {
    const double r2 = p.dot(p);
    const double radial = 1.0 + r2 * (camera.k1 + r2 * (camera.k2 + r2 * camera.k3));
    const double bend = 2.0 * (camera.k1 + r2 * (2.0 * camera.k2 + r2 * 3.0 * camera.k3));
    const double across = bend * p[0] * p[1] + 2.0 * camera.p1 * p[0] + 2.0 * camera.p2 * p[1];
    Mat2 slope;
    slope(0, 0) = radial + bend * p[0] * p[0] + 2.0 * camera.p1 * p[1] + 6.0 * camera.p2 * p[0];
    slope(0, 1) = across;
    slope(1, 0) = across;
    slope(1, 1) = radial + bend * p[1] * p[1] + 6.0 * camera.p1 * p[1] + 2.0 * camera.p2 * p[0];
    return slope;
}

}  // namespace

Projection project(const CameraModel& camera, const Vec3& headset_point_mm) {
    const Vec3 x = camera.camera_from_headset * (headset_point_mm - camera.centre_mm);
    Projection result;
    result.z_mm = x[2];
    if (!(x[2] > 1e-9)) return result;
    const Vec2 d = distort(camera, Vec2{x[0] / x[2], x[1] / x[2]});
    result.pixel = Vec2{camera.fx_px * d[0] + camera.cx_px, camera.fy_px * d[1] + camera.cy_px};
    return result;
}

Vec3 pixel_ray(const CameraModel& camera, const Vec2& pixel) {
    const Vec2 target{(pixel[0] - camera.cx_px) / camera.fx_px, (pixel[1] - camera.cy_px) / camera.fy_px};
    Vec2 p = target;
    for (int i = 0; i < kUndistortSteps; ++i) {
        const Vec2 error = distort(camera, p) - target;
        const Mat2 slope = distortion_slope(camera, p);
        const double determinant = slope(0, 0) * slope(1, 1) - slope(0, 1) * slope(1, 0);
        if (determinant > kFoldDeterminant) {
            p -= Vec2{slope(1, 1) * error[0] - slope(0, 1) * error[1],
                      slope(0, 0) * error[1] - slope(1, 0) * error[0]} /
                 determinant;
        } else {
            p -= error;
        }
    }
    const Vec3 direction{p[0], p[1], 1.0};
    const Vec3 headset = camera.camera_from_headset.transpose() * direction;
    return headset / std::sqrt(headset.dot(headset));
}

}  // namespace rig
