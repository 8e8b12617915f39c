// The source's own way to find unseen markers: project one marker set after the other onto its modes, set the
// known markers again, and repeat  [Zhang06 section 10.1, MotionPropagation]. The reference that the closed
// form of inference.hpp is measured against; no stage of a frame uses it.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/linalg.hpp"
#include "core/limits.hpp"
#include "core/pack/solve_pack.hpp"

namespace rig {

struct PropagationConfig {
    std::uint16_t most_sweeps = 50;   // the source's error is near its optimum after that many
    std::uint16_t most_modes = 10;    // of a set; the source keeps 5 to 10
    double least_progress_mm = 1e-4;  // mean over the known markers, from one sweep to the next
    // Which of the sets that hold a known marker is projected first: one of the finest level, or the whole
    // face. The source's "lowest hierarchy" can be read either way.
    bool begins_fine = true;
};

struct PropagationReport {
    std::uint16_t sweeps = 0;
    bool settled = false;            // false: the cap ended it
    double known_error_mm = 0.0;     // mean distance at the known markers after the last sweep's projections
    std::uint16_t sets_visited = 0;  // in the last sweep
};

struct PropagationWorkspace {
    // Which sets share a marker with a set and lie on the next coarser or finer level.
    std::array<std::array<bool, kMaxMarkerSets>, kMaxMarkerSets> neighbours{};
    std::array<bool, kMaxMarkerSets> visited{};
    std::array<std::uint8_t, kMaxMarkerSets> path{};  // sets whose neighbours are being visited
    std::array<std::uint8_t, kMaxMarkerSets> next{};  // ... and which of them comes next
    std::array<Vec3, kMaxMarkers> given_mm{};
    std::array<double, kMaxRows> offset_mm{};
    std::array<double, kMaxRows> projected_mm{};
};

// Once for these sets and this workspace.
void prepare_propagation(std::span<const MarkerSetModel> sets, PropagationWorkspace& workspace);

// sets: as in SolvePack, the whole face first. known [m]: whether displacement_mm[k] (from neutral) is
// given; displacement_mm [m]: on entry the known ones (the others are ignored and start at 0), on return all
// of them as the last sweep's projections left them. With no marker known all stay 0. The workspace is
// prepared.
PropagationReport propagate_motion(std::span<const MarkerSetModel> sets, std::span<const bool> known,
                                   const PropagationConfig& config, PropagationWorkspace& workspace,
                                   std::span<Vec3> displacement_mm);

}  // namespace rig
