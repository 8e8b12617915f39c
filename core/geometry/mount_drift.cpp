#include "core/geometry/mount_drift.hpp"

#include <cmath>

#include "core/base/check.hpp"
#include "core/base/math.hpp"
#include "core/geometry/triangulation.hpp"

namespace rig {

namespace {

constexpr int kSteps = 3;               // Gauss-Newton; turns are of milliradians
constexpr double kMostSigmaRad = 0.02;  // marks too near each other leave the roll open

struct TurnSums {
    Mat3 information = Mat3::Zero();
    Vec3 right = Vec3::Zero();
    double squared_px = 0.0;
    std::uint16_t count = 0;
};

// Marks within reach of where the camera, turned, expects them.
TurnSums sum_up(const CameraModel& camera, const MountDriftConfig& config,
                std::span<const ReferenceMark> marks, const Vec3& turn_rad) {
    TurnSums sums;
    const CameraModel turned = turned_camera(camera, turn_rad);
    const double weight = 1.0 / (config.sigma_px * config.sigma_px);
    for (const ReferenceMark& mark : marks) {
        const Vec3 at = turned.camera_from_headset * (mark.headset_mm - turned.centre_mm);
        if (!mark.seen || !(at[2] > 1.0)) continue;
        const Vec2 error = mark.seen_px - project_in_camera(turned, at).pixel;
        if (error.dot(error) > config.mistaken_px * config.mistaken_px) continue;
        Mat3 cross;  // of the point with a small turn: turn x at = -at x turn
        cross << 0.0, at[2], -at[1], -at[2], 0.0, at[0], at[1], -at[0], 0.0;
        const PixelSlope slope = pixel_slope_in_camera(turned, at) * cross;
        const Mat3 information = slope.transpose() * slope;
        const Vec3 right = slope.transpose() * error;
        sums.information += weight * information;
        sums.right += weight * right;
        sums.squared_px += error.dot(error);
        ++sums.count;
    }
    return sums;
}

double shift_px(const CameraModel& camera, const Vec3& turn_rad) {
    const double f = 0.5 * (camera.fx_px + camera.fy_px);
    return f * std::sqrt(turn_rad[0] * turn_rad[0] + turn_rad[1] * turn_rad[1]);
}

// Three marks that agree with each other do not jump together unless their camera did.
bool is_jolt(const CameraModel& camera, const MountDriftConfig& config, const Vec3& turn_rad,
             const MountDriftReport& report, const MountDriftState& state) {
    return report.marks_used >= 3 && report.residual_px < 0.5 * config.jolt_px &&
           shift_px(camera, turn_rad - state.turn_rad) > config.jolt_px;
}

void step_flag(const MountDriftConfig& config, double shift, MountDriftState& state) {
    const bool across = state.drifted ? shift < config.clear_px : shift > config.raise_px;
    state.frames_across = across ? static_cast<std::uint16_t>(state.frames_across + 1) : std::uint16_t{0};
    if (state.frames_across < config.frames_before) return;
    state.drifted = !state.drifted;
    state.frames_across = 0;
}

}  // namespace

void reset_mount_drift(MountDriftState& state) {
    state = MountDriftState{};
}

CameraModel turned_camera(const CameraModel& camera, const Vec3& turn_rad) {
    CameraModel turned = camera;
    turned.camera_from_headset = rotation_from_vector(turn_rad) * camera.camera_from_headset;
    return turned;
}

void watch_mount(const CameraModel& camera, const MountDriftConfig& config,
                 std::span<const ReferenceMark> marks, MountDriftState& state, MountDriftReport& report) {
    const Vec3 start_rad = state.turn_rad;
    watch_mount(camera, config, marks, start_rad, state, report);
}

void watch_mount(const CameraModel& camera, const MountDriftConfig& config,
                 std::span<const ReferenceMark> marks, const Vec3& start_rad, MountDriftState& state,
                 MountDriftReport& report) {
    RIG_CHECK(marks.size() <= kMaxReferenceMarks);
    report = MountDriftReport{};
    Vec3 turn = start_rad;
    TurnSums sums = sum_up(camera, config, marks, turn);
    for (int step = 0; step < kSteps; ++step) {
        if (sums.count < 2 ||
            !covariance_from_information(sums.information, kMostSigmaRad, report.covariance_rad2)) {
            break;
        }
        const Vec3 move = report.covariance_rad2 * sums.right;
        // Small turns add up; what the order of turning changes is of second order in milliradians.
        turn += move;
        sums = sum_up(camera, config, marks, turn);
        report.measured = step + 1 == kSteps;
    }
    report.marks_used = sums.count;
    if (report.measured) {
        report.residual_px = std::sqrt(sums.squared_px / static_cast<double>(sums.count));
        report.frame_turn_rad = turn;
        const bool anew = !state.started || is_jolt(camera, config, turn, report, state);
        const double keep = anew ? 0.0 : config.keep;
        state.turn_rad = (keep * state.turn_rad + (1.0 - keep) * turn).eval();
        state.started = true;
        step_flag(config, shift_px(camera, state.turn_rad), state);
    }
    report.drifted = state.drifted;
    report.turn_rad = state.turn_rad;
    report.shift_px = shift_px(camera, state.turn_rad);
}

}  // namespace rig
