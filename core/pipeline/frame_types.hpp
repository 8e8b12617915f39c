// What goes into the pipeline and what its report tells. The stages behind it are in pipeline.hpp.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/face_state.hpp"
#include "core/base/linalg.hpp"
#include "core/detect/observation.hpp"
#include "core/filter/smoothing.hpp"
#include "core/geometry/mount_drift.hpp"
#include "core/geometry/pnp.hpp"
#include "core/image/view.hpp"
#include "core/stabilise/neutral_capture.hpp"
#include "core/track/marker_watch.hpp"

namespace rig {

enum class LossPolicy : std::uint8_t { kHold = 0, kDecay = 1 };

struct PipelineConfig {
    bool stabilise = true;  // false: input is already in the face frame
    // false: the cameras stand beside the performer. What they see move as a whole is the head, not the
    // helmet: FrameReport::head_pose tells it, no slip is put out and none raises an alarm.
    bool camera_on_head = true;
    bool filter = true;  // smoothing and recovery blends; a temporal prior in the pack stays on either way
    FilterChoice smoothing;  // per shape, when `filter` is set
    bool windows = true;  // look for a tracked face's markers where they should be, not in the whole picture
    LossPolicy loss_policy = LossPolicy::kHold;
    MarkerPolarity polarity = MarkerPolarity::kAuto;
    double rate_hz = 60.0;
};

// One tick's images. images[c] is empty when camera c delivered nothing; status[c] then says why.
struct FrameSet {
    std::int64_t capture_us = 0;
    std::array<ImageView, kMaxCameras> images{};
    std::array<CameraStatus, kMaxCameras> status{};
    std::uint8_t camera_count = 0;
};

// One tick's observations as detection reported them, for re-solving a recorded take.
struct ObservationFrame {
    std::int64_t capture_us = 0;
    std::array<std::span<const Observation>, kMaxCameras> cameras{};
    std::array<CameraStatus, kMaxCameras> status{};
    std::uint8_t camera_count = 0;
};

// One tick of a labelled marker stream: entry k is marker k of the pack; a non-finite coordinate means not
// seen.
struct LabelledFrame {
    std::int64_t capture_us = 0;
    std::span<const Vec3> positions_mm;
};

// One tick of an unlabelled stream: points in any order, ghosts among them; a non-finite point is an empty
// slot.
struct PointFrame {
    std::int64_t capture_us = 0;
    std::span<const Vec3> positions_mm;
};

struct FrameReport {
    // solve certificate
    double kkt = 0.0;            // largest move of a projected Jacobi step; dimensionless
    double objective_mm2 = 0.0;  // E at the answer
    std::uint16_t iterations = 0;
    std::uint16_t working_set_changes = 0;  // variables that reached or left a bound, in this frame's solve
    std::uint16_t markers_used = 0;
    double residual_rms_mm = 0.0;  // over the coordinates of the markers used
    double hull_distance = 0.0;    // RBF packs: distance to the nearest reference, in its widths
    bool optimal = false;          // false: the iteration cap ended the solve at a feasible point
    bool solved = false;           // this tick has a solve behind it, whatever the ladder makes of it
    // smoothing: how far back the frame lies that the weights answer for; 0 when nothing was smoothed
    std::uint16_t delay_frames = 0;
    std::int64_t delay_us = 0;  // in true time; state.capture_us is earlier by it
    // identity
    std::array<std::uint16_t, kMaxCameras> observations{};  // detected per camera
    std::uint16_t markers_seen = 0;
    std::uint16_t swaps_repaired = 0;
    std::uint16_t names_rejected = 0;
    bool bootstrapped = false;  // identities were found anew in this frame
    // markers that came off or slid (F18), while the face is tracked; [marker_count]
    std::array<MarkerTrouble, kMaxMarkers> marker_trouble{};
    std::array<float, kMaxMarkers> marker_off_mm{};  // of a slid one: how far it stands off its place
    std::array<std::int16_t, kMaxPoints>
        labels{};  // PointFrame input: the marker each point was taken for, -1 none
    // how each camera sits on the helmet, by the pack's reference marks; nothing measured without them
    std::array<MountDriftReport, kMaxCameras> mounts{};
    // where the head is, by the pixels of its named markers; only when the cameras are not on it
    HeadPose head_pose;
    NeutralReport neutral;  // of a neutral that is being taken
    // stabilised, completed markers in the face frame, mm; [marker_count]
    std::array<Vec3, kMaxMarkers> face_markers_mm{};
    // 1 measured .. 0 unknown, and the expected distance from the truth of those inferred;
    // completed_markers.hpp
    std::array<float, kMaxMarkers> marker_confidence{};
    std::array<float, kMaxMarkers> marker_deviation_mm{};
};

}  // namespace rig
