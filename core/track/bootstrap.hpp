// Finds identities from nothing: which sighting is which marker, at an unknown pose of the helmet and with an
// unknown expression. Deformable iterative matching from several starting poses, gates tightening as the fit
// gets better.
#pragma once

#include <cstdint>

#include "core/geometry/shape_model.hpp"
#include "core/track/naming_rounds.hpp"
#include "core/track/pose_votes.hpp"

namespace rig {

struct BootstrapConfig {
    // Where the face is looked for, about the nominal pose and the rig's origin.
    double point_rotation_range_rad = 0.436;   // 25 degrees: streams of points
    double camera_rotation_range_rad = 0.175;  // 10 degrees: a helmet on the head
    double translation_range_mm = 20.0;
    double rotation_sigma_rad = 0.15;  // about the pose a start begins with
    double translation_sigma_mm = 12.0;
    int starts_per_frame = 3;  // bounds the work of a tick; the next tick goes on with the next starts
    double accept_explained_at_once = 0.96;  // of the sightings
    double accept_explained = 0.85;  // ... when several ticks of search found no better, or none is thinkable
    double accept_seen = 0.5;        // of the markers
    double accept_residual_mm = 1.2;  // rms after the last round
};

struct BootstrapState {
    std::uint16_t next_start = 0;
    std::uint16_t ticks = 0;  // of search
};

// A face placed roughly, by its leading modes.
struct BootstrapStart {
    ShapeFit fit;
    double score = 0.0;  // of the sightings it explains
};

struct BootstrapWorkspace {
    NamingWorkspace naming;
    Matches first_names{};  // of the tick's first start that explains enough
    PoseVotesWorkspace votes;
    BoundedVector<PoseCandidate, kPoseCandidates> candidates;
    BoundedVector<BootstrapStart, kPoseCandidates> starts;
};

struct BootstrapReport {
    bool found = false;
    std::uint16_t seen = 0;
    double explained = 0.0;  // share of the sightings that got a name
    double residual_mm = 0.0;
    double expression = 0.0;  // summed squares of the modes' coefficients
};

// On success `fit` is the pose and expression behind the best naming. `nominal` is headset_from_face of a
// helmet that sits as calibrated.
[[nodiscard]] BootstrapReport bootstrap(const ShapeModel& model, const BootstrapConfig& config,
                                        const Rigid& nominal, const SightingSet& sightings,
                                        BootstrapState& state, BootstrapWorkspace& workspace, ShapeFit& fit);

}  // namespace rig
