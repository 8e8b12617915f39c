#include "core/geometry/mount_drift.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "core/base/math.hpp"
#include "tests/support/random.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

CameraModel helmet_camera() {
    CameraModel camera;
    camera.width_px = 480;
    camera.height_px = 640;
    camera.fx_px = 600.0;
    camera.fy_px = 601.0;
    camera.cx_px = 240.0;
    camera.cy_px = 318.0;
    camera.k1 = -0.11;
    camera.k2 = 0.02;
    camera.camera_from_headset << 1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0;
    camera.centre_mm = Vec3{0.0, -40.0, 230.0};
    return camera;
}

// Dots on the brim, at the rim of the picture, as the camera `now` sees them.
std::vector<ReferenceMark> marks_seen_by(const CameraModel& now, double noise_px,
                                         test::SeededRandom& random) {
    std::vector<ReferenceMark> marks;
    for (const Vec3& at : {Vec3{-45.0, 35.0, 70.0}, Vec3{0.0, 40.0, 75.0}, Vec3{45.0, 35.0, 70.0},
                           Vec3{-50.0, -100.0, 60.0}, Vec3{50.0, -100.0, 60.0}}) {
        const test::ReferencePixel p = test::reference_project(now, at);
        marks.push_back({at,
                         Vec2{static_cast<double>(p.x_px) + random.normal(0.0, noise_px),
                              static_cast<double>(p.y_px) + random.normal(0.0, noise_px)},
                         true});
    }
    return marks;
}

TEST(WatchMount, FindsTheTurnExactlyWithoutNoise) {
    test::SeededRandom random(5);
    const CameraModel camera = helmet_camera();
    for (int i = 0; i < 50; ++i) {
        const Vec3 turn{random.uniform(-6e-3, 6e-3), random.uniform(-6e-3, 6e-3),
                        random.uniform(-6e-3, 6e-3)};
        MountDriftState state;
        MountDriftReport report;
        watch_mount(camera, {}, marks_seen_by(turned_camera(camera, turn), 0.0, random), state, report);
        ASSERT_TRUE(report.measured);
        EXPECT_EQ(report.marks_used, 5);
        EXPECT_LT((report.turn_rad - turn).norm(), 1e-9);
        EXPECT_LT(report.residual_px, 1e-6);
    }
}

// The covariance of one frame's turn is what repeated frames show.
TEST(WatchMount, CovarianceIsWhatRepetitionShows) {
    test::SeededRandom random(6);
    const CameraModel camera = helmet_camera();
    MountDriftConfig config;
    config.sigma_px = 0.2;
    Mat3 spread = Mat3::Zero();
    Mat3 claimed = Mat3::Zero();
    constexpr int kFrames = 4000;
    for (int i = 0; i < kFrames; ++i) {
        MountDriftState state;
        MountDriftReport report;
        watch_mount(camera, config, marks_seen_by(camera, 0.2, random), state, report);
        ASSERT_TRUE(report.measured);
        spread += report.turn_rad * report.turn_rad.transpose() / kFrames;
        claimed = report.covariance_rad2;
    }
    for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(spread(axis, axis) / claimed(axis, axis), 1.0, 0.1) << axis;
}

TEST(WatchMount, RaisesTheFlagForABentBracketAndClearsItWhenMended) {
    test::SeededRandom random(7);
    const CameraModel camera = helmet_camera();
    const MountDriftConfig config;
    MountDriftState state;
    MountDriftReport report;
    const auto run = [&](const CameraModel& now, int frames) {
        int changed_at = -1;
        const bool before = state.drifted;
        for (int i = 0; i < frames; ++i) {
            watch_mount(camera, config, marks_seen_by(now, 0.1, random), state, report);
            if (report.drifted != before && changed_at < 0) changed_at = i;
        }
        return changed_at;
    };
    EXPECT_EQ(run(camera, 3000), -1) << "noise alone raises nothing";
    const CameraModel bent = turned_camera(camera, Vec3{0.0, 2e-3, 0.0});  // 1.2 px
    const int raised = run(bent, 200);
    EXPECT_GE(raised, config.frames_before - 1);
    EXPECT_LE(raised, 60);
    EXPECT_TRUE(report.drifted);
    EXPECT_NEAR(report.shift_px, 1.2, 0.1);
    EXPECT_GE(run(camera, 200), config.frames_before - 1);
    EXPECT_FALSE(report.drifted);
}

TEST(WatchMount, LeavesMistakenMarksOutAndSaysWhenItMeasuresNothing) {
    test::SeededRandom random(8);
    const CameraModel camera = helmet_camera();
    MountDriftState state;
    MountDriftReport report;
    std::vector<ReferenceMark> marks = marks_seen_by(camera, 0.05, random);
    marks[2].seen_px += Vec2{25.0, -4.0};
    watch_mount(camera, {}, marks, state, report);
    EXPECT_TRUE(report.measured);
    EXPECT_EQ(report.marks_used, 4);
    EXPECT_LT(report.turn_rad.norm(), 1e-3);
    for (ReferenceMark& mark : marks) mark.seen = &mark == marks.data();
    const Vec3 before = state.turn_rad;
    watch_mount(camera, {}, marks, state, report);
    EXPECT_FALSE(report.measured);
    EXPECT_EQ(state.turn_rad, before);
    marks[0].headset_mm[2] = 500.0;  // behind the camera
    watch_mount(camera, {}, marks, state, report);
    EXPECT_EQ(report.marks_used, 0);
    watch_mount(camera, {}, {}, state, report);
    EXPECT_FALSE(report.measured);
}

}  // namespace
}  // namespace rig
