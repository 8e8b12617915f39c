// One round of naming: predicted markers against the sightings of every view, each sighting used once; and
// what the named sightings of a marker say together.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/bounded_vector.hpp"
#include "core/geometry/shape_fit.hpp"
#include "core/track/assignment.hpp"
#include "core/track/named_markers.hpp"
#include "core/track/sightings.hpp"

namespace rig {

// match[view][marker]: index of the sighting in that view, or -1.
using Matches = std::array<std::array<std::int16_t, kMaxMarkers>, kMaxCameras>;

// The sightings of a view in a plane, sorted by their first coordinate into buckets: what can lie within the
// gate of a marker lies near it here. Of a camera the slopes of its rays, of a point cloud x and y.
struct ViewPlane {
    static constexpr std::size_t kBuckets = 64;
    bool usable = false;  // false: rays without a common origin or axis; every pair is looked at
    bool from_rays = false;
    Vec3 origin_mm = Vec3::Zero();
    std::array<Vec3, 3> axes{};  // two across, one along the view
    double steepest = 0.0;       // largest slope of a ray
    double low = 0.0;            // of the first coordinate
    double buckets_per_unit = 0.0;
    std::array<std::uint16_t, kBuckets + 1> bucket_start{};
    std::array<std::uint16_t, kMaxSightings> order{};
    std::array<double, kMaxSightings> first{};   // by sighting
    std::array<double, kMaxSightings> second{};  // by sighting
    std::array<std::uint8_t, kMaxSightings> bucket{};
};

struct MatchingWorkspace {
    ViewPlane plane;
    // Pairs within the gate: of marker k at [pair_start[k], pair_start[k + 1]).
    std::array<std::uint16_t, kMaxMarkers + 1> pair_start{};
    std::array<std::uint16_t, kMaxMarkers * kMaxSightings> pair_sighting{};
    std::array<double, kMaxMarkers * kMaxSightings> pair_cost{};
    // Markers that compete for sightings, directly or through others, form a group, named by its first
    // marker.
    std::array<std::uint16_t, kMaxMarkers> group{};
    std::array<std::uint16_t, kMaxMarkers> group_size{};     // by its first marker
    std::array<std::int16_t, kMaxSightings> first_marker{};  // that is near a sighting, -1 none
    std::array<std::uint16_t, kMaxMarkers> rows{};           // of one group
    std::array<std::uint16_t, kMaxSightings> columns{};
    std::array<std::int16_t, kMaxSightings> column_of{};
    std::array<std::int16_t, kMaxMarkers> chosen{};
    std::array<double, kMaxMarkers * kMaxSightings> cost{};
    AssignmentWorkspace assignment;
};

[[nodiscard]] bool same_names(std::size_t marker_count, const SightingSet& sightings, const Matches& a,
                              const Matches& b);

// Sightings of each view that no marker was given, rising.
using LeftOverSightings = std::array<BoundedVector<std::uint16_t, kMaxSightings>, kMaxCameras>;
void find_left_over(std::size_t marker_count, const SightingSet& sightings, const Matches& matches,
                    LeftOverSightings& left_over);

// Optimal assignment per view, cost = squared distance of the prediction from the ray or point, nothing
// beyond the gate. Groups of markers without a common sighting are assigned apart: the same optimum.
// predicted_mm [marker_count], headset frame, at the frame's capture time. velocity_mm_per_us [marker_count]
// where a rolling shutter's rows count, else empty: each prediction is moved to the exposure of the row it is
// compared with.
void match_views(std::span<const Vec3> predicted_mm, const SightingSet& sightings, double gate_mm,
                 MatchingWorkspace& workspace, Matches& matches,
                 std::span<const Vec3> velocity_mm_per_us = {});

// Position, at the frame's capture time, and information of every matched marker. A sighting that disagrees
// with the other views of its marker by more than gap_limit_mm is dropped from the match.
void combine_views(std::span<const Vec3> predicted_mm, const SightingSet& sightings, double gap_limit_mm,
                   Matches& matches, NamedMarkers& named, std::span<const Vec3> velocity_mm_per_us = {});

}  // namespace rig
