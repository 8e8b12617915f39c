#include "firmware_host/companion/calibrate/headset_frame.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/math.hpp"
#include "tests/support/board_scene/board_scene.hpp"

namespace rig::host {
namespace {

// The same rig in another frame: x_new = R x + t.
std::vector<CameraModel> moved(std::vector<CameraModel> cameras, const Vec3& turn_rad, const Vec3& shift_mm) {
    const Mat3 turn = rotation_from_vector(turn_rad);
    for (CameraModel& camera : cameras) {
        camera.camera_from_headset = (camera.camera_from_headset * turn.transpose()).eval();
        camera.centre_mm = (turn * camera.centre_mm + shift_mm).eval();
    }
    return cameras;
}

double angle_between(const CameraModel& a, const CameraModel& b) {
    return vector_from_rotation(a.camera_from_headset * b.camera_from_headset.transpose()).norm();
}

TEST(AlignToReference, UndoesAnyMotionOfTheWholeRig) {
    test::SeededRandom random(3);
    for (std::size_t count = 1; count <= 4; ++count) {
        const std::vector<CameraModel> truth = test::board_rig(LensModel::kRational, count);
        for (int i = 0; i < 20; ++i) {
            const Vec3 turn{random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5)};
            const Vec3 shift{random.uniform(-300.0, 300.0), random.uniform(-300.0, 300.0),
                             random.uniform(-300.0, 300.0)};
            std::vector<CameraModel> cameras = moved(truth, turn, shift);
            EXPECT_LT(align_to_reference(cameras, truth), 1e-9);
            for (std::size_t c = 0; c < count; ++c) {
                EXPECT_LT((cameras[c].centre_mm - truth[c].centre_mm).norm(), 1e-9);
                EXPECT_LT(angle_between(cameras[c], truth[c]), 1e-9);
            }
        }
    }
}

// A rig that calibration knows only in its first camera's frame is put where tracking can start: the face is
// within 10 degrees and 15 mm of where a helmet that really stands so has it.
TEST(PlaceBeforeFace, IsNearARealHelmet) {
    const Vec3 mouth{0.0, -33.0, 20.0};
    for (std::size_t count = 1; count <= 4; ++count) {
        const std::vector<CameraModel> truth = test::board_rig(LensModel::kRational, count);
        std::vector<CameraModel> cameras = moved(truth, Vec3{0.4, -1.1, 0.3}, Vec3{20.0, -500.0, 90.0});
        place_before_face(cameras, 200.0);
        for (std::size_t c = 0; c < count; ++c) {
            EXPECT_LT(angle_between(cameras[c], truth[c]), 10.0 * 3.14159 / 180.0) << count;
            // The same point before the camera, in the guessed frame.
            const Vec3 in_camera = truth[c].camera_from_headset * (mouth - truth[c].centre_mm);
            const Vec3 guessed =
                cameras[c].camera_from_headset.transpose() * in_camera + cameras[c].centre_mm;
            EXPECT_LT((guessed - mouth).norm(), 15.0) << count;
        }
    }
}

}  // namespace
}  // namespace rig::host
