#include "tests/replay/solver_digests/geometry_digest.hpp"

#include <array>
#include <vector>

#include "core/geometry/camera_model.hpp"
#include "core/geometry/mount_drift.hpp"
#include "core/geometry/pnp.hpp"
#include "core/geometry/triangulation.hpp"
#include "tests/support/random.hpp"

namespace rig {

namespace {

CameraModel random_camera(test::SeededRandom& random) {
    CameraModel camera;
    camera.width_px = 480;
    camera.height_px = 640;
    camera.fx_px = random.uniform(300.0, 700.0);
    camera.fy_px = camera.fx_px + random.uniform(-2.0, 2.0);
    camera.cx_px = random.uniform(230.0, 250.0);
    camera.cy_px = random.uniform(310.0, 330.0);
    camera.lens = random.chance(0.5) ? LensModel::kFisheye : LensModel::kRational;
    for (double* k : {&camera.k1, &camera.k2, &camera.k3, &camera.k4}) *k = random.uniform(-0.05, 0.05);
    if (camera.lens == LensModel::kRational) {
        for (double* k : {&camera.p1, &camera.p2, &camera.k5, &camera.k6}) *k = random.uniform(-0.01, 0.01);
    }
    camera.camera_from_headset << 1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0;
    camera = turned_camera(
        camera, Vec3{random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3)});
    camera.centre_mm = Vec3{random.uniform(-60.0, 60.0), random.uniform(-90.0, 30.0), 220.0};
    return camera;
}

void add(test::Digest& digest, const Vec3& v) {
    for (int i = 0; i < 3; ++i) digest.add(v[i]);
}

}  // namespace

void add_geometry(test::Digest& digest) {
    test::SeededRandom random(12);
    for (int round = 0; round < 200; ++round) {
        const std::array<CameraModel, 3> cameras{random_camera(random), random_camera(random),
                                                 random_camera(random)};
        MountDriftState state;
        MountDriftReport report;
        std::vector<ReferenceMark> marks;
        for (int i = 0; i < 8; ++i) {
            const Vec3 point{random.uniform(-50.0, 50.0), random.uniform(-80.0, 40.0),
                             random.uniform(-10.0, 40.0)};
            std::vector<PixelSighting> sightings;
            for (const CameraModel& camera : cameras) {
                const Vec2 pixel =
                    project(camera, point).pixel + Vec2{random.normal(0.0, 0.2), random.normal(0.0, 0.2)};
                add(digest, pixel_ray(camera, pixel));
                sightings.push_back({&camera, pixel, 0.2});
            }
            const PointFit fit = triangulate_pixels(sightings);
            add(digest, fit.position_mm);
            for (int k = 0; k < 9; ++k) digest.add(fit.covariance_mm2(k / 3, k % 3));
            digest.add(fit.rms_px);
            marks.push_back({point, sightings[0].pixel, true});
        }
        std::vector<NamedPixel> named;
        for (const ReferenceMark& mark : marks) named.push_back({&cameras[0], mark.headset_mm, mark.seen_px});
        const HeadPose pose = solve_pnp(named, {.sigma_px = 0.2});
        add(digest, pose.reference_from_face.translation_mm);
        for (int k = 0; k < 9; ++k) digest.add(pose.reference_from_face.rotation(k / 3, k % 3));
        add(digest, pose.rotation_sigma_rad);
        for (int frame = 0; frame < 3; ++frame) watch_mount(cameras[0], {}, marks, state, report);
        add(digest, report.turn_rad);
        digest.add(report.shift_px);
    }
}

}  // namespace rig
