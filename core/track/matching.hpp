// One round of naming: predicted markers against the sightings of every view, each sighting used once; and
// what the named sightings of a marker say together.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/geometry/shape_fit.hpp"
#include "core/track/assignment.hpp"
#include "core/track/named_markers.hpp"
#include "core/track/sightings.hpp"

namespace rig {

// match[view][marker]: index of the sighting in that view, or -1.
using Matches = std::array<std::array<std::int16_t, kMaxMarkers>, kMaxCameras>;

struct MatchingWorkspace {
    std::array<double, kMaxMarkers * kMaxSightings> cost{};
    AssignmentWorkspace assignment;
};

// Optimal assignment per view, cost = squared distance of the prediction from the ray or point, nothing
// beyond the gate. predicted_mm [marker_count], headset frame.
void match_views(std::span<const Vec3> predicted_mm, const SightingSet& sightings, double gate_mm,
                 MatchingWorkspace& workspace, Matches& matches);

// Position and information of every matched marker. A sighting that disagrees with the other views of its
// marker by more than gap_limit_mm is dropped from the match.
void combine_views(std::span<const Vec3> predicted_mm, const SightingSet& sightings, double gap_limit_mm,
                   Matches& matches, NamedMarkers& named);

}  // namespace rig
