#include "core/track/matching.hpp"

#include <algorithm>

#include "core/base/bounded_vector.hpp"
#include "core/base/check.hpp"

namespace rig {

namespace {

constexpr double kDepthPriorSigmaMm = 3.0;  // of a predicted depth along a single ray
constexpr double kMostPriorShare =
    1e-3;  // of what a sighting measures: a prediction never pulls a measured point

using MarkerSightings = BoundedVector<Sighting, kMaxCameras>;

// Where the marker was when the sighting's row was exposed, from where it is at the capture time.
Vec3 at_row(const Vec3& position_mm, const Sighting& sighting, std::span<const Vec3> velocity_mm_per_us,
            std::size_t marker) {
    return velocity_mm_per_us.empty() ? position_mm
                                      : Vec3{position_mm + sighting.delay_us * velocity_mm_per_us[marker]};
}

void gather(const SightingSet& sightings, const Matches& matches, std::span<const Vec3> velocity_mm_per_us,
            std::size_t marker, MarkerSightings& out) {
    out.clear();
    for (std::size_t view = 0; view < sightings.view_count; ++view) {
        const std::int16_t at = matches[view][marker];
        if (at < 0) continue;
        const Sighting& sighting = sightings.views[view][static_cast<std::size_t>(at)];
        const bool kept = out.push_back(
            velocity_mm_per_us.empty() ? sighting : at_capture(sighting, velocity_mm_per_us[marker]));
        RIG_CHECK(kept);
    }
}

double prior_information(const MarkerSightings& mine) {
    double most = 1.0 / (kDepthPriorSigmaMm * kDepthPriorSigmaMm);
    for (const Sighting& sighting : mine) most = std::min(most, kMostPriorShare * sighting.information);
    return most;
}

// Takes away the match that lies farthest from the prediction.
void drop_farthest(const Vec3& predicted_mm, const SightingSet& sightings,
                   std::span<const Vec3> velocity_mm_per_us, std::size_t marker, Matches& matches) {
    std::size_t farthest = sightings.view_count;
    double largest = -1.0;
    for (std::size_t view = 0; view < sightings.view_count; ++view) {
        const std::int16_t at = matches[view][marker];
        if (at < 0) continue;
        const Sighting& sighting = sightings.views[view][static_cast<std::size_t>(at)];
        const double d2 =
            sighting.squared_distance_mm2(at_row(predicted_mm, sighting, velocity_mm_per_us, marker));
        if (d2 > largest) {
            largest = d2;
            farthest = view;
        }
    }
    if (farthest < sightings.view_count) matches[farthest][marker] = -1;
}

}  // namespace

void match_views(std::span<const Vec3> predicted_mm, const SightingSet& sightings, double gate_mm,
                 MatchingWorkspace& workspace, Matches& matches, std::span<const Vec3> velocity_mm_per_us) {
    RIG_CHECK(velocity_mm_per_us.empty() || velocity_mm_per_us.size() == predicted_mm.size());
    const std::size_t markers = predicted_mm.size();
    for (std::size_t view = 0; view < sightings.view_count; ++view) {
        const ViewSightings& seen = sightings.views[view];
        for (std::size_t k = 0; k < markers; ++k) {
            for (std::size_t j = 0; j < seen.size(); ++j) {
                workspace.cost[k * seen.size() + j] =
                    seen[j].squared_distance_mm2(at_row(predicted_mm[k], seen[j], velocity_mm_per_us, k));
            }
        }
        AssignmentProblem problem;
        problem.row_count = markers;
        problem.column_count = seen.size();
        problem.cost = workspace.cost;
        problem.alone_cost = gate_mm * gate_mm;
        solve_assignment(problem, workspace.assignment, matches[view]);
    }
}

void combine_views(std::span<const Vec3> predicted_mm, const SightingSet& sightings, double gap_limit_mm,
                   Matches& matches, NamedMarkers& named, std::span<const Vec3> velocity_mm_per_us) {
    RIG_CHECK(velocity_mm_per_us.empty() || velocity_mm_per_us.size() == predicted_mm.size());
    named.count = static_cast<std::uint16_t>(predicted_mm.size());
    MarkerSightings mine;
    for (std::size_t k = 0; k < predicted_mm.size(); ++k) {
        NamedMarker& marker = named.markers[k];
        marker = NamedMarker{};
        gather(sightings, matches, velocity_mm_per_us, k, mine);
        if (mine.empty()) continue;
        Triangulation point = triangulate(mine.span(), predicted_mm[k], prior_information(mine));
        while (mine.size() > 1 && point.gap_mm > gap_limit_mm) {
            drop_farthest(predicted_mm[k], sightings, velocity_mm_per_us, k, matches);
            gather(sightings, matches, velocity_mm_per_us, k, mine);
            point = triangulate(mine.span(), predicted_mm[k], prior_information(mine));
        }
        marker.seen = true;
        marker.views = sightings.from_cameras ? static_cast<std::uint8_t>(mine.size()) : std::uint8_t{0};
        marker.position_mm = point.position_mm;
        marker.information = point.information;
    }
}

}  // namespace rig
