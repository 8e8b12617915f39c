// Observations -> named markers over time. Nobody hands it labels: identities come from the layout's
// geometry, are carried from frame to frame by prediction and optimal assignment, and are checked against the
// shape of a face in every frame, so that a swap cannot settle.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/geometry/shape_fit.hpp"
#include "core/track/bootstrap.hpp"
#include "core/track/marker_watch.hpp"
#include "core/track/matching.hpp"
#include "core/track/named_markers.hpp"
#include "core/track/second_opinion.hpp"
#include "core/track/sightings.hpp"
#include "core/track/topology.hpp"

namespace rig {

struct TrackerConfig {
    Rigid nominal;  // headset_from_face as calibrated
    double rate_hz = 60.0;
    double first_gate_mm = 6.0;  // around the motion prediction: the largest surprise of a frame
    double final_gate_mm = 3.0;  // around the fitted face, at least
    double gap_limit_mm = 1.5;   // between the views of one marker
    double outlier_mm = 2.5;     // from the fitted face; beyond it a name is doubted
    // Who comes back farther than this from the fitted face waits a frame for its name: a ghost rarely stays.
    // Right ones came back within 0.36 mm on the public streams, the one ghost that was taken within 1.97.
    double return_mm = 1.0;
    // That a marker which had come off has to be seen in, of the last twice as many; at most 31.
    std::uint8_t fallen_return_frames = 30;
    // Mean squared distance from the face, over the noise's, beyond which the names are suspected: 0.7 and at
    // most 1.1 with right ones on the public streams, 5 and more with a lip on the chin.
    double suspicious_ratio = 4.0;
    double pose_sigma_rad = 0.03;  // per frame, jolts included
    double pose_sigma_mm = 3.0;
    double expression_sigma = 0.6;  // per frame, in modes' standard deviations
    double velocity_keep = 0.6;     // of the last step, as the prediction of the next
    bool correct_rows = true;       // move what a rolling shutter saw to the frame's capture time
    double lost_share = 0.25;       // fewer markers than this share for lost_frames means: start anew
    std::uint16_t lost_frames = 3;
    BootstrapConfig bootstrap;
    MarkerWatchConfig watch;                  // its rate is rate_hz
    std::span<const Vec3> neutral_offset_mm;  // [marker_count] or empty: how the neutral differs, face frame
};

struct TrackerState {
    bool tracking = false;
    std::uint16_t poor_frames = 0;
    std::int64_t capture_us = 0;  // of the last frame
    ShapeFit fit;                 // of the last frame
    ShapeFitMemory memory;
    std::array<Vec3, kMaxMarkers> position_mm{};  // last known, headset frame
    std::array<Vec3, kMaxMarkers> velocity_mm{};  // per frame
    std::array<Vec3, kMaxMarkers> bias_mm{};      // how a marker differs from the fitted face, slowly learnt
    std::array<std::uint16_t, kMaxMarkers> missed{};  // frames since it was last seen
    BootstrapState bootstrap;
    Topology topology;  // of the model, from the start of tracking on
    SecondOpinionState opinion;
    MarkerWatchState watch;
    // The last 64 frames of a marker that waits for its name, newest in bit 0: set when it was in its place.
    std::array<std::uint64_t, kMaxMarkers> returning{};
};

struct TrackerWorkspace {
    BootstrapWorkspace bootstrap;
    MatchingWorkspace matching;
    ShapeFitWorkspace fit;
    Matches matches{};
    Matches first_matches{};
    Matches fitted_matches{};  // the names behind `next`
    ShapeFit next;
    std::array<Vec3, kMaxMarkers> predicted_mm{};
    std::array<Vec3, kMaxMarkers> velocity_mm_per_us{};  // during this frame; used with a rolling shutter
    std::array<Vec3, kMaxMarkers> before_mm{};  // in the last frame, when this one's names were reconsidered
    std::array<Vec3, kMaxMarkers> positions_mm{};
    std::array<Mat3, kMaxMarkers> informations{};
    std::array<bool, kMaxMarkers> broken{};     // order among neighbours
    std::array<bool, kMaxMarkers> off_place{};  // known to be, when opinions were heard last
    LeftOverSightings left_over;                // of the final names
};

struct TrackerReport {
    std::uint16_t seen = 0;
    std::uint16_t swaps_repaired = 0;  // names that the shape check changed
    std::uint16_t rejected = 0;        // sightings that had a name and lost it
    std::uint16_t order_broken = 0;    // pairs of neighbours whose names contradicted their order
    std::uint16_t reconsidered = 0;    // names that a second opinion changed
    std::uint16_t fallen = 0;          // markers that have come off the face
    std::uint16_t slid = 0;            // ... and that stand off their place for good
    bool bootstrapped = false;
    bool tracking = false;
    double residual_mm = 0.0;  // rms distance from the fitted face
    std::array<MarkerTrouble, kMaxMarkers> trouble{};
    std::array<float, kMaxMarkers> off_mm{};  // of slid markers: from their place, the neutral's offset aside
    Matches matches{};
};

void reset_tracker(TrackerState& state);

// Where each marker should be in the next frame, headset frame; valid until the workspace is used again.
// Precondition: state.tracking.
[[nodiscard]] std::span<const Vec3> predict_markers(const ShapeModel& model, const TrackerConfig& config,
                                                    const TrackerState& state, TrackerWorkspace& workspace);

// One tick of unnamed sightings.
void track(const ShapeModel& model, const TrackerConfig& config, const SightingSet& sightings,
           TrackerState& state, TrackerWorkspace& workspace, NamedMarkers& named, TrackerReport& report);

// One tick of a stream that claims to know its names: entry k is marker k, non-finite when not seen. Names
// that the face contradicts are repaired among each other or dropped.
void check_names(const ShapeModel& model, const TrackerConfig& config, std::span<const Vec3> labelled_mm,
                 double sigma_mm, TrackerState& state, TrackerWorkspace& workspace, SightingSet& scratch,
                 NamedMarkers& named, TrackerReport& report);

}  // namespace rig
