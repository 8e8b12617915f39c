// Finds identities from nothing: which sighting is which marker, at an unknown pose of the helmet and with an
// unknown expression. Deformable iterative matching from several starting poses, gates tightening as the fit
// gets better.
#pragma once

#include <cstdint>

#include "core/geometry/shape_model.hpp"
#include "core/track/matching.hpp"

namespace rig {

struct BootstrapConfig {
    double start_spacing_mm = 7.0;     // starts form a grid of this spacing around the nominal pose
    double rotation_sigma_rad = 0.15;  // expected helmet slip about the nominal pose
    double translation_sigma_mm = 12.0;
    int starts_per_frame = 3;         // bounds the work of a tick; the next tick goes on with the next starts
    double accept_explained = 0.85;   // of the sightings
    double accept_seen = 0.5;         // of the markers
    double accept_residual_mm = 1.2;  // rms after the last round
};

struct BootstrapState {
    std::uint16_t next_start = 0;
};

struct BootstrapWorkspace {
    MatchingWorkspace matching;
    ShapeFitWorkspace fit;
    Matches matches{};
    NamedMarkers named;
    ShapeFit trial;
    std::array<Vec3, kMaxMarkers> predicted_mm{};
    std::array<Vec3, kMaxMarkers> positions_mm{};
    std::array<Mat3, kMaxMarkers> informations{};
};

struct BootstrapReport {
    bool found = false;
    std::uint16_t seen = 0;
    double explained = 0.0;  // share of the sightings that got a name
    double residual_mm = 0.0;
};

// On success `fit` is the pose and expression behind the best naming. `nominal` is headset_from_face of a
// helmet that sits as calibrated.
[[nodiscard]] BootstrapReport bootstrap(const ShapeModel& model, const BootstrapConfig& config,
                                        const Rigid& nominal, const SightingSet& sightings,
                                        BootstrapState& state, BootstrapWorkspace& workspace, ShapeFit& fit);

}  // namespace rig
