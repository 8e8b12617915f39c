#include "core/geometry/camera_model.hpp"

#include <cmath>

#include "core/base/math.hpp"

namespace rig {

namespace {

constexpr int kUndistortSteps = 12;  // Newton; a lens of 75 degrees with k1 = -0.3 needs 6 for 1e-9 px
constexpr double kFoldDeterminant =
    0.05;                          // under it the pixel lies where the lens model folds: no Newton step there
constexpr int kFisheyeSteps = 24;  // Newton needs 5; where the model is flat, halving gains a bit a step
constexpr double kQuarterTurn = 1.57079632679489661923;
constexpr double kNearAxis = 1e-9;  // tan of the angle from the axis under which theta_d / r is its limit

// The radial factor of the rational model and twice its slope along r2.
struct Radial {
    double factor;
    double bend;
};

Radial radial_of(const CameraModel& camera, double r2) {
    Radial radial{1.0 + r2 * (camera.k1 + r2 * (camera.k2 + r2 * camera.k3)),
                  2.0 * (camera.k1 + r2 * (2.0 * camera.k2 + r2 * 3.0 * camera.k3))};
    if (camera.k4 == 0.0 && camera.k5 == 0.0 && camera.k6 == 0.0) return radial;
    const double below = 1.0 + r2 * (camera.k4 + r2 * (camera.k5 + r2 * camera.k6));
    const double below_bend = 2.0 * (camera.k4 + r2 * (2.0 * camera.k5 + r2 * 3.0 * camera.k6));
    radial.factor = radial.factor / below;
    radial.bend = (radial.bend - radial.factor * below_bend) / below;
    return radial;
}

Vec2 distort(const CameraModel& camera, const Vec2& p, const Radial& radial) {
    const double r2 = p.dot(p);
    const double xy = p[0] * p[1];
    return {p[0] * radial.factor + 2.0 * camera.p1 * xy + camera.p2 * (r2 + 2.0 * p[0] * p[0]),
            p[1] * radial.factor + camera.p1 * (r2 + 2.0 * p[1] * p[1]) + 2.0 * camera.p2 * xy};
}

Mat2 distortion_slope(const CameraModel& camera, const Vec2& p, const Radial& radial) {
    const double across = radial.bend * p[0] * p[1] + 2.0 * camera.p1 * p[0] + 2.0 * camera.p2 * p[1];
    Mat2 slope;
    slope(0, 0) = radial.factor + radial.bend * p[0] * p[0] + 2.0 * camera.p1 * p[1] + 6.0 * camera.p2 * p[0];
    slope(0, 1) = across;
    slope(1, 0) = across;
    slope(1, 1) = radial.factor + radial.bend * p[1] * p[1] + 6.0 * camera.p1 * p[1] + 2.0 * camera.p2 * p[0];
    return slope;
}

Vec3 undistort_rational(const CameraModel& camera, const Vec2& target) {
    Vec2 p = target;
    for (int i = 0; i < kUndistortSteps; ++i) {
        const Vec2 before = p;
        const Radial radial = radial_of(camera, p.dot(p));
        const Vec2 error = distort(camera, p, radial) - target;
        const Mat2 slope = distortion_slope(camera, p, radial);
        const double determinant = slope(0, 0) * slope(1, 1) - slope(0, 1) * slope(1, 0);
        if (determinant > kFoldDeterminant) {
            p -= Vec2{slope(1, 1) * error[0] - slope(0, 1) * error[1],
                      slope(0, 0) * error[1] - slope(1, 0) * error[0]} /
                 determinant;
        } else {
            p -= error;
        }
        if (p == before) break;  // and would stay there
    }
    return {p[0], p[1], 1.0};
}

double fisheye_radius(const CameraModel& camera, double theta) {
    const double t2 = theta * theta;
    return theta * (1.0 + t2 * (camera.k1 + t2 * (camera.k2 + t2 * (camera.k3 + t2 * camera.k4))));
}

double fisheye_slope(const CameraModel& camera, double theta) {
    const double t2 = theta * theta;
    return 1.0 +
           t2 * (3.0 * camera.k1 + t2 * (5.0 * camera.k2 + t2 * (7.0 * camera.k3 + t2 * 9.0 * camera.k4)));
}

// Newton inside a bracket that only shrinks; a step that leaves it halves it instead. Up to a quarter turn:
// what a helmet camera has beside or behind it is no face.
double fisheye_angle(const CameraModel& camera, double radius) {
    double low = 0.0;
    double high = kQuarterTurn;
    double theta = radius < high ? radius : high;
    for (int i = 0; i < kFisheyeSteps; ++i) {
        const double error = fisheye_radius(camera, theta) - radius;
        if (error > 0.0) {
            high = theta;
        } else {
            low = theta;
        }
        const double slope = fisheye_slope(camera, theta);
        const double newton = theta - error / slope;
        theta = slope > kFoldDeterminant && newton >= low && newton <= high ? newton : 0.5 * (low + high);
    }
    return theta;
}

Vec3 undistort_fisheye(const CameraModel& camera, const Vec2& target) {
    const double radius = std::sqrt(target.dot(target));
    if (!(radius > kNearAxis)) return {target[0], target[1], 1.0};
    const SinCos at = sin_cos(fisheye_angle(camera, radius));
    return {target[0] / radius * at.sin, target[1] / radius * at.sin, at.cos};
}

Vec2 distort_fisheye(const CameraModel& camera, const Vec3& x) {
    const double across = std::sqrt(x[0] * x[0] + x[1] * x[1]);
    if (!(across > kNearAxis * x[2])) return {x[0] / x[2], x[1] / x[2]};
    const double scale = fisheye_radius(camera, atan2(across, x[2])) / across;
    return {scale * x[0], scale * x[1]};
}

PixelSlope fisheye_plane_slope(const CameraModel& camera, const Vec3& x) {
    PixelSlope slope = PixelSlope::Zero();
    const double across = std::sqrt(x[0] * x[0] + x[1] * x[1]);
    if (!(across > kNearAxis * x[2])) {
        slope(0, 0) = slope(1, 1) = 1.0 / x[2];
        slope(0, 2) = -x[0] / (x[2] * x[2]);
        slope(1, 2) = -x[1] / (x[2] * x[2]);
        return slope;
    }
    const double theta = atan2(across, x[2]);
    const double rise = fisheye_slope(camera, theta) / (across * across + x[2] * x[2]);
    const double scale = fisheye_radius(camera, theta) / across;
    const double scale_across =
        (rise * x[2] - scale) / across;  // slope of scale along the distance from the axis
    for (int row = 0; row < 2; ++row) {
        for (int column = 0; column < 2; ++column)
            slope(row, column) = (row == column ? scale : 0.0) + x[row] * scale_across * x[column] / across;
        slope(row, 2) = -x[row] * rise;
    }
    return slope;
}

PixelSlope rational_plane_slope(const CameraModel& camera, const Vec3& x) {
    const Vec2 p{x[0] / x[2], x[1] / x[2]};
    const Mat2 bend = distortion_slope(camera, p, radial_of(camera, p.dot(p)));
    PixelSlope slope;
    for (int row = 0; row < 2; ++row) {
        slope(row, 0) = bend(row, 0) / x[2];
        slope(row, 1) = bend(row, 1) / x[2];
        slope(row, 2) = -(bend(row, 0) * p[0] + bend(row, 1) * p[1]) / x[2];
    }
    return slope;
}

}  // namespace

PixelSlope pixel_slope_in_camera(const CameraModel& camera, const Vec3& x) {
    PixelSlope slope =
        camera.lens == LensModel::kFisheye ? fisheye_plane_slope(camera, x) : rational_plane_slope(camera, x);
    slope.row(0) *= camera.fx_px;
    slope.row(1) *= camera.fy_px;
    return slope;
}

Projection project_in_camera(const CameraModel& camera, const Vec3& x) {
    Projection result;
    result.z_mm = x[2];
    if (!(x[2] > 1e-9)) return result;
    Vec2 d;
    if (camera.lens == LensModel::kFisheye) {
        d = distort_fisheye(camera, x);
    } else {
        const Vec2 p{x[0] / x[2], x[1] / x[2]};
        d = distort(camera, p, radial_of(camera, p.dot(p)));
    }
    result.pixel = Vec2{camera.fx_px * d[0] + camera.cx_px, camera.fy_px * d[1] + camera.cy_px};
    return result;
}

Projection project(const CameraModel& camera, const Vec3& headset_point_mm) {
    return project_in_camera(camera, camera.camera_from_headset * (headset_point_mm - camera.centre_mm));
}

Vec3 pixel_ray(const CameraModel& camera, const Vec2& pixel) {
    const Vec2 target{(pixel[0] - camera.cx_px) / camera.fx_px, (pixel[1] - camera.cy_px) / camera.fy_px};
    const Vec3 direction = camera.lens == LensModel::kFisheye ? undistort_fisheye(camera, target)
                                                              : undistort_rational(camera, target);
    const Vec3 headset = camera.camera_from_headset.transpose() * direction;
    return headset / std::sqrt(headset.dot(headset));
}

double row_delay_us(const CameraModel& camera, double y_px) {
    return camera.row_time_us * (y_px - 0.5 * (camera.height_px - 1));
}

}  // namespace rig
