// Watches whether a camera still sits on the helmet as calibrated, through marks that are fixed to the
// helmet: dots on the arms or the brim whose places in the headset frame are known. Not the slip of the
// helmet on the head: the stabiliser has that.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/linalg.hpp"
#include "core/geometry/camera_model.hpp"
#include "core/limits.hpp"

namespace rig {

// As a pack declares it.
struct HelmetMark {
    Vec3 headset_mm = Vec3::Zero();
    std::uint8_t cameras = 0;  // bit c: camera c can see it

    [[nodiscard]] bool is_seen_by(std::size_t camera) const { return (cameras >> camera & 1U) != 0; }
};

struct ReferenceMark {
    Vec3 headset_mm = Vec3::Zero();
    Vec2 seen_px = Vec2::Zero();
    bool seen = false;
};

struct MountDriftConfig {
    double sigma_px = 0.1;     // standard deviation of a mark's measured centre
    double keep = 0.95;        // of the running estimate, a frame: about 20 frames are averaged
    double mistaken_px = 8.0;  // a mark off its expected place by more is another dot
    double jolt_px = 1.0;      // a turn that moves the picture by more at once starts the average anew
    double raise_px = 0.5;     // mean displacement of the picture that raises the flag ...
    double clear_px = 0.3;     // ... and that clears it
    std::uint16_t frames_before = 30;  // in a row on the other side, before the flag changes
};

struct MountDriftState {
    Vec3 turn_rad = Vec3::Zero();  // running estimate; camera axes
    bool started = false;
    bool drifted = false;
    std::uint16_t frames_across = 0;  // in a row on the other side of the threshold
};

struct MountDriftReport {
    std::uint16_t marks_used = 0;
    bool measured = false;         // this frame had at least two marks, apart enough
    bool drifted = false;          // raise Fault::kRigMoved
    Vec3 turn_rad = Vec3::Zero();  // small turn of the camera from its calibrated pose, camera axes; averaged
    Vec3 frame_turn_rad = Vec3::Zero();   // this frame's own, valid when measured
    Mat3 covariance_rad2 = Mat3::Zero();  // of this frame's own turn, before averaging
    double shift_px = 0.0;                // how far the turn moves a point in the middle of the picture
    double residual_px = 0.0;             // rms distance of the marks from where the turned camera sees them
};

void reset_mount_drift(MountDriftState& state);

// One frame of one camera. Least squares for a small turn of the camera about its centre: at a helmet's
// distances a bent bracket turns a picture by pixels before it moves it. Marks whose distance from the pixel
// expected so far exceeds mistaken_px are left out. The search starts at state.turn_rad, or at start_rad when
// the caller knows that the camera was knocked. Preconditions: at most kMaxReferenceMarks; all numbers
// finite.
void watch_mount(const CameraModel& camera, const MountDriftConfig& config,
                 std::span<const ReferenceMark> marks, MountDriftState& state, MountDriftReport& report);
void watch_mount(const CameraModel& camera, const MountDriftConfig& config,
                 std::span<const ReferenceMark> marks, const Vec3& start_rad, MountDriftState& state,
                 MountDriftReport& report);

// The camera as it sits now.
[[nodiscard]] CameraModel turned_camera(const CameraModel& camera, const Vec3& turn_rad);

}  // namespace rig
