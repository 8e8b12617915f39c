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
};

// From none to more than a helmet's wide lens shows.
constexpr std::array<Distortion, 6> kDistortions{{{0.0, 0.0, 0.0, 0.0, 0.0},
                                                  {-0.18, 0.05, 0.0007, -0.0011, -0.004},
                                                  {-0.30, 0.09, 0.0, 0.0, 0.0},
                                                  {0.12, -0.02, -0.002, 0.003, 0.0},
                                                  {-0.05, 0.0, 0.004, 0.004, 0.01},
                                                  {0.0, -0.08, 0.0, 0.0, 0.02}}};

void set_distortion(CameraModel& camera, const Distortion& d) {
    camera.k1 = d.k1;
    camera.k2 = d.k2;
    camera.p1 = d.p1;
    camera.p2 = d.p2;
    camera.k3 = d.k3;
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
