#include "core/geometry/camera_model.hpp"

#include <cmath>

namespace rig {

namespace {

constexpr int kUndistortIterations = 20;  // converged to 1e-12 for |k1 r2| up to 0.3; each step is a contraction

Vec2 distort(const CameraModel& camera, const Vec2& p) {
    const double r2 = p.dot(p);
    const double radial = 1.0 + r2 * (camera.k1 + r2 * (camera.k2 + r2 * camera.k3));
    const double xy = p[0] * p[1];
    return {p[0] * radial + 2.0 * camera.p1 * xy + camera.p2 * (r2 + 2.0 * p[0] * p[0]),
            p[1] * radial + camera.p1 * (r2 + 2.0 * p[1] * p[1]) + 2.0 * camera.p2 * xy};
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
    for (int i = 0; i < kUndistortIterations; ++i) {
        const Vec2 error = distort(camera, p) - target;
        p -= error;
    }
    const Vec3 direction{p[0], p[1], 1.0};
    const Vec3 headset = camera.camera_from_headset.transpose() * direction;
    return headset / std::sqrt(headset.dot(headset));
}

}  // namespace rig
