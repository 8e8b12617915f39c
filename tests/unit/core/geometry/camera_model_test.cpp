#include "core/geometry/camera_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/base/math.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

CameraModel posed_camera() {
    CameraModel camera;
    camera.width_px = 640;
    camera.height_px = 480;
    camera.fx_px = 520.0;
    camera.fy_px = 518.0;
    camera.cx_px = 322.5;
    camera.cy_px = 236.0;
    camera.camera_from_headset = rotation_from_vector(Vec3{2.9, 0.3, -0.2});
    camera.centre_mm = Vec3{30.0, -45.0, 205.0};
    return camera;
}

struct Distortion {
    double k1, k2, p1, p2, k3;
    double k4 = 0.0, k5 = 0.0, k6 = 0.0;
    LensModel lens = LensModel::kRational;
};

// From none to more than a helmet's wide lens shows.
constexpr std::array<Distortion, 10> kDistortions{
    {{0.0, 0.0, 0.0, 0.0, 0.0},
     {-0.18, 0.05, 0.0007, -0.0011, -0.004},
     {-0.30, 0.09, 0.0, 0.0, 0.0},
     {0.12, -0.02, -0.002, 0.003, 0.0},
     {-0.05, 0.0, 0.004, 0.004, 0.01},
     {0.0, -0.08, 0.0, 0.0, 0.02},
     // rational: a wide lens as OpenCV fits one
     {0.35, 0.02, 0.0004, -0.0006, 0.001, 0.55, 0.06, 0.002},
     {-0.4, 0.3, 0.001, 0.0, -0.05, -0.2, 0.25, -0.03},
     // fisheye
     {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, LensModel::kFisheye},
     {-0.03, 0.012, 0.0, 0.0, -0.006, 0.001, 0.0, 0.0, LensModel::kFisheye}}};

void set_distortion(CameraModel& camera, const Distortion& d) {
    camera.k1 = d.k1;
    camera.k2 = d.k2;
    camera.p1 = d.p1;
    camera.p2 = d.p2;
    camera.k3 = d.k3;
    camera.k4 = d.k4;
    camera.k5 = d.k5;
    camera.k6 = d.k6;
    camera.lens = d.lens;
}

TEST(CameraModel, ProjectsAsTheLongDoubleFormula) {
    test::SeededRandom random(21);
    CameraModel camera = posed_camera();
    for (const Distortion& distortion : kDistortions) {
        set_distortion(camera, distortion);
        for (int i = 0; i < 300; ++i) {
            const Vec3 in_camera{random.uniform(-90.0, 90.0), random.uniform(-70.0, 70.0),
                                 random.uniform(120.0, 300.0)};
            const Vec3 point = camera.camera_from_headset.transpose() * in_camera + camera.centre_mm;
            const Projection p = project(camera, point);
            const test::ReferencePixel expected = test::reference_project(camera, point);
            EXPECT_NEAR(p.pixel[0], static_cast<double>(expected.x_px), 1e-9);
            EXPECT_NEAR(p.pixel[1], static_cast<double>(expected.y_px), 1e-9);
            EXPECT_NEAR(p.z_mm, in_camera[2], 1e-9);
        }
    }
}

// The ray of every pixel, followed by any distance, comes back to the pixel: by the independent formula.
TEST(CameraModel, RayOfAPixelProjectsBackOverTheWholeImage) {
    CameraModel camera = posed_camera();
    for (const Distortion& distortion : kDistortions) {
        set_distortion(camera, distortion);
        // The strongest one is as wide as a helmet camera gets: 75 degrees across.
        camera.fx_px = camera.fy_px = &distortion == &kDistortions[2] ? 420.0 : 520.0;
        // A fisheye of 160 degrees across its diagonal.
        if (distortion.lens == LensModel::kFisheye) camera.fx_px = camera.fy_px = 290.0;
        double worst = 0.0;
        for (int x = 0; x < camera.width_px; x += 13) {
            for (int y = 0; y < camera.height_px; y += 13) {
                const Vec3 ray = pixel_ray(camera, Vec2{static_cast<double>(x), static_cast<double>(y)});
                EXPECT_NEAR(ray.norm(), 1.0, 1e-14);
                const test::ReferencePixel back =
                    test::reference_project(camera, camera.centre_mm + 180.0 * ray);
                worst = std::max({worst, std::fabs(static_cast<double>(back.x_px) - x),
                                  std::fabs(static_cast<double>(back.y_px) - y)});
            }
        }
        EXPECT_LT(worst, 1e-8) << "k1 " << distortion.k1 << " k2 " << distortion.k2;
    }
}

TEST(CameraModel, RayPassesThroughTheProjectedPoint) {
    test::SeededRandom random(22);
    CameraModel camera = posed_camera();
    set_distortion(camera, kDistortions[1]);
    for (int i = 0; i < 200; ++i) {
        const Vec3 in_camera{random.uniform(-80.0, 80.0), random.uniform(-60.0, 60.0),
                             random.uniform(150.0, 280.0)};
        const Vec3 point = camera.camera_from_headset.transpose() * in_camera + camera.centre_mm;
        const Vec3 ray = pixel_ray(camera, project(camera, point).pixel);
        const Vec3 off = (point - camera.centre_mm).cross(ray);
        EXPECT_LT(off.norm(), 1e-8);
        EXPECT_GT(ray.dot(point - camera.centre_mm), 0.0) << "the ray points forward";
    }
}

TEST(CameraModel, SlopesAreThoseOfTheLongDoubleFormula) {
    test::SeededRandom random(23);
    CameraModel camera = posed_camera();
    camera.camera_from_headset = Mat3::Identity();
    camera.centre_mm = Vec3::Zero();
    for (const Distortion& distortion : kDistortions) {
        set_distortion(camera, distortion);
        for (int i = 0; i < 100; ++i) {
            Vec3 at{random.uniform(-90.0, 90.0), random.uniform(-70.0, 70.0), random.uniform(120.0, 300.0)};
            if (i == 0) at = Vec3{0.0, 0.0, 150.0};
            const PixelSlope slope = pixel_slope_in_camera(camera, at);
            for (int axis = 0; axis < 3; ++axis) {
                constexpr double kStep = 1e-2;
                Vec3 ahead = at;
                Vec3 behind = at;
                ahead[axis] += kStep;
                behind[axis] -= kStep;
                const test::ReferencePixel a = test::reference_project(camera, ahead);
                const test::ReferencePixel b = test::reference_project(camera, behind);
                EXPECT_NEAR(slope(0, axis), static_cast<double>(a.x_px - b.x_px) / (2.0 * kStep), 1e-6);
                EXPECT_NEAR(slope(1, axis), static_cast<double>(a.y_px - b.y_px) / (2.0 * kStep), 1e-6);
            }
        }
    }
}

// The angle from the axis that a pixel of an equidistant lens stands for, by definition.
TEST(CameraModel, AFisheyesPixelsStandForAngles) {
    CameraModel camera = posed_camera();
    camera.lens = LensModel::kFisheye;
    camera.fy_px = camera.fx_px;
    const Vec3 axis = camera.camera_from_headset.row(2).transpose();
    for (int degrees = 0; degrees <= 89; ++degrees) {
        const double angle = degrees * 3.14159265358979323846 / 180.0;
        const Vec3 ray = pixel_ray(camera, Vec2{camera.cx_px + 0.6 * camera.fx_px * angle,
                                                camera.cy_px - 0.8 * camera.fx_px * angle});
        EXPECT_NEAR(ray.dot(axis), std::cos(angle), 1e-14) << degrees;
    }
}

TEST(CameraModel, RaysStayFiniteWhereTheModelFoldsAndBeyondTheImage) {
    CameraModel camera = posed_camera();
    for (const LensModel lens : {LensModel::kRational, LensModel::kFisheye}) {
        camera.lens = lens;
        camera.k1 = -0.9;
        camera.k2 = 0.1;
        camera.k4 = lens == LensModel::kFisheye ? -0.5 : 0.1;
        for (int x = -2000; x <= 2600; x += 97) {
            for (int y = -2000; y <= 2600; y += 89) {
                const Vec3 ray = pixel_ray(camera, Vec2{static_cast<double>(x), static_cast<double>(y)});
                EXPECT_TRUE(is_finite(ray[0]) && is_finite(ray[1]) && is_finite(ray[2])) << x << " " << y;
            }
        }
    }
}

TEST(CameraModel, RowsAreLateByTheirDistanceFromTheMiddle) {
    CameraModel camera = posed_camera();
    EXPECT_EQ(row_delay_us(camera, 17.0), 0.0) << "global shutter";
    camera.row_time_us = 20.0;
    EXPECT_DOUBLE_EQ(row_delay_us(camera, 239.5), 0.0);
    EXPECT_DOUBLE_EQ(row_delay_us(camera, 0.0), -4790.0);
    EXPECT_DOUBLE_EQ(row_delay_us(camera, 479.0), 4790.0);
}

TEST(CameraModel, PointsBehindAreToldByTheirDepth) {
    const CameraModel camera = posed_camera();
    const Vec3 behind = camera.camera_from_headset.transpose() * Vec3{5.0, 5.0, -50.0} + camera.centre_mm;
    EXPECT_NEAR(project(camera, behind).z_mm, -50.0, 1e-9);
    const Projection at_centre = project(camera, camera.centre_mm);
    EXPECT_EQ(at_centre.z_mm, 0.0);
    EXPECT_TRUE(is_finite(at_centre.pixel[0]) && is_finite(at_centre.pixel[1]));
}

}  // namespace
}  // namespace rig
