#include "core/track/matching.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/bounded_vector.hpp"
#include "core/base/check.hpp"
#include "core/base/math.hpp"

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

constexpr double kLeastCosine = 0.3;  // of a ray with its view's axis, to be told by its slopes
constexpr double kSlack = 1.0 + 1e-9;

// Any double; beyond the ends counts as the end, NaN as the first.
std::size_t bucket_at(const ViewPlane& plane, double first) {
    const double at = (first - plane.low) * plane.buckets_per_unit;
    if (!(at > 0.0)) return 0;
    if (at >= static_cast<double>(ViewPlane::kBuckets - 1)) return ViewPlane::kBuckets - 1;
    return static_cast<std::size_t>(at);
}

// Across and along the middle of the rays. False when there is none.
bool find_axes(std::span<const Sighting> seen, ViewPlane& plane) {
    Vec3 along = Vec3::Zero();
    for (const Sighting& sighting : seen) {
        if (sighting.point_mm != seen[0].point_mm) return false;
        along += sighting.direction;
    }
    const double length = std::sqrt(along.dot(along));
    if (!(length > kLeastCosine * static_cast<double>(seen.size()))) return false;
    along /= length;
    plane.axes[0] = perpendicular_to(along);
    plane.axes[1] = along.cross(plane.axes[0]);
    plane.axes[2] = along;
    plane.origin_mm = seen[0].point_mm;
    return true;
}

bool place_sightings(std::span<const Sighting> seen, ViewPlane& plane) {
    plane.steepest = 0.0;
    for (std::size_t j = 0; j < seen.size(); ++j) {
        if (!plane.from_rays) {
            plane.first[j] = seen[j].point_mm[0];
            plane.second[j] = seen[j].point_mm[1];
            continue;
        }
        const double along = plane.axes[2].dot(seen[j].direction);
        if (!(along > kLeastCosine)) return false;
        plane.first[j] = plane.axes[0].dot(seen[j].direction) / along;
        plane.second[j] = plane.axes[1].dot(seen[j].direction) / along;
        plane.steepest = std::max({plane.steepest, std::abs(plane.first[j]), std::abs(plane.second[j])});
    }
    return true;
}

void fill_buckets(std::size_t count, ViewPlane& plane) {
    plane.low = plane.first[0];
    double high = plane.first[0];
    for (std::size_t j = 1; j < count; ++j) {
        plane.low = std::min(plane.low, plane.first[j]);
        high = std::max(high, plane.first[j]);
    }
    const double width = high - plane.low;
    plane.buckets_per_unit = width > 0.0 ? static_cast<double>(ViewPlane::kBuckets) / width : 0.0;
    plane.bucket_start.fill(0);
    for (std::size_t j = 0; j < count; ++j) {
        plane.bucket[j] = static_cast<std::uint8_t>(bucket_at(plane, plane.first[j]));
        ++plane.bucket_start[plane.bucket[j] + 1U];
    }
    for (std::size_t b = 0; b < ViewPlane::kBuckets; ++b) {
        plane.bucket_start[b + 1] =
            static_cast<std::uint16_t>(plane.bucket_start[b + 1] + plane.bucket_start[b]);
    }
    std::array<std::uint16_t, ViewPlane::kBuckets> next{};
    std::copy_n(plane.bucket_start.begin(), ViewPlane::kBuckets, next.begin());
    for (std::size_t j = 0; j < count; ++j)
        plane.order[next[plane.bucket[j]]++] = static_cast<std::uint16_t>(j);
}

void lay_out(std::span<const Sighting> seen, ViewPlane& plane) {
    plane.usable = false;
    if (seen.empty()) return;
    plane.from_rays = seen[0].direction.squaredNorm() > 0.0;
    for (const Sighting& sighting : seen) {
        if ((sighting.direction.squaredNorm() > 0.0) != plane.from_rays) return;
    }
    if (plane.from_rays && !find_axes(seen, plane)) return;
    if (!place_sightings(seen, plane)) return;
    fill_buckets(seen.size(), plane);
    plane.usable = true;
}

// Where in the plane a marker's sightings can lie.
struct Window {
    double first = 0.0;
    double second = 0.0;
    double half = 0.0;
    bool known = false;
};

// A ray of slope m within g of a marker at depth z has |y - m z| <= g (1 + |m|), y the marker's offset.
Window window_around(const Vec3& x_mm, double gate_mm, const ViewPlane& plane) {
    if (!plane.usable) return {};
    if (!plane.from_rays) return {x_mm[0], x_mm[1], gate_mm * kSlack, true};
    const Vec3 q = x_mm - plane.origin_mm;
    const double depth = plane.axes[2].dot(q);
    if (!(depth > gate_mm)) return {};
    return {plane.axes[0].dot(q) / depth, plane.axes[1].dot(q) / depth,
            gate_mm * (1.0 + plane.steepest) / depth * kSlack, true};
}

// How far a marker moves between the capture time and the row exposed farthest from it.
double farthest_row_us(std::span<const Sighting> seen) {
    double most = 0.0;
    for (const Sighting& sighting : seen) most = std::max(most, std::abs(sighting.delay_us));
    return most;
}

void find_pairs(std::span<const Vec3> predicted_mm, std::span<const Sighting> seen, double gate_mm,
                std::span<const Vec3> velocity_mm_per_us, MatchingWorkspace& w) {
    const ViewPlane& plane = w.plane;
    const double gate_mm2 = gate_mm * gate_mm;
    const double row_us = velocity_mm_per_us.empty() ? 0.0 : farthest_row_us(seen);
    std::size_t count = 0;
    const auto look_at = [&](std::size_t j, std::size_t k) {
        const double cost =
            seen[j].squared_distance_mm2(at_row(predicted_mm[k], seen[j], velocity_mm_per_us, k));
        if (!(cost < gate_mm2)) return;
        w.pair_sighting[count] = static_cast<std::uint16_t>(j);
        w.pair_cost[count++] = cost > 0.0 ? cost : 0.0;
    };
    for (std::size_t k = 0; k < predicted_mm.size(); ++k) {
        w.pair_start[k] = static_cast<std::uint16_t>(count);
        const Vec3& x = predicted_mm[k];
        const double moved_mm = row_us > 0.0 ? row_us * std::sqrt(velocity_mm_per_us[k].squaredNorm()) : 0.0;
        const Window window = window_around(x, gate_mm + moved_mm, plane);
        if (!window.known) {
            for (std::size_t j = 0; j < seen.size(); ++j) look_at(j, k);
            continue;
        }
        const std::size_t end = plane.bucket_start[bucket_at(plane, window.first + window.half) + 1];
        for (std::size_t i = plane.bucket_start[bucket_at(plane, window.first - window.half)]; i < end; ++i) {
            const std::size_t j = plane.order[i];
            if (std::abs(plane.second[j] - window.second) <= window.half) look_at(j, k);
        }
    }
    w.pair_start[predicted_mm.size()] = static_cast<std::uint16_t>(count);
}

void join(std::size_t a, std::size_t b, MatchingWorkspace& w) {
    while (w.group[a] != a) a = w.group[a];
    while (w.group[b] != b) b = w.group[b];
    const std::size_t low = std::min(a, b);
    w.group[std::max(a, b)] = static_cast<std::uint16_t>(low);
}

void find_groups(std::size_t markers, std::size_t sightings, MatchingWorkspace& w) {
    for (std::size_t j = 0; j < sightings; ++j) w.first_marker[j] = -1;
    for (std::size_t k = 0; k < markers; ++k) {
        w.group[k] = static_cast<std::uint16_t>(k);
        for (std::size_t i = w.pair_start[k]; i < w.pair_start[k + 1]; ++i) {
            std::int16_t& first = w.first_marker[w.pair_sighting[i]];
            if (first < 0) {
                first = static_cast<std::int16_t>(k);
            } else {
                join(k, static_cast<std::size_t>(first), w);
            }
        }
    }
    // A marker's leader comes before it, so its own leader is final already.
    for (std::size_t k = 0; k < markers; ++k) {
        w.group[k] = w.group[w.group[k]];
        w.group_size[k] = 0;
        ++w.group_size[w.group[k]];
    }
}

// Rows, columns and costs of the group that `leader` leads.
AssignmentProblem problem_of(std::size_t leader, std::size_t markers, double alone_cost,
                             MatchingWorkspace& w) {
    AssignmentProblem problem;
    problem.alone_cost = alone_cost;
    for (std::size_t k = leader; k < markers && problem.row_count < w.group_size[leader]; ++k) {
        if (w.group[k] != leader) continue;
        w.rows[problem.row_count++] = static_cast<std::uint16_t>(k);
        for (std::size_t i = w.pair_start[k]; i < w.pair_start[k + 1]; ++i)
            w.column_of[w.pair_sighting[i]] = -1;
    }
    for (std::size_t r = 0; r < problem.row_count; ++r) {
        for (std::size_t i = w.pair_start[w.rows[r]]; i < w.pair_start[w.rows[r] + 1U]; ++i) {
            const std::size_t j = w.pair_sighting[i];
            if (w.column_of[j] >= 0) continue;
            w.column_of[j] = static_cast<std::int16_t>(problem.column_count);
            w.columns[problem.column_count++] = static_cast<std::uint16_t>(j);
        }
    }
    std::fill_n(w.cost.begin(), problem.row_count * problem.column_count, alone_cost);
    for (std::size_t r = 0; r < problem.row_count; ++r) {
        double* row = w.cost.data() + r * problem.column_count;
        for (std::size_t i = w.pair_start[w.rows[r]]; i < w.pair_start[w.rows[r] + 1U]; ++i) {
            row[w.column_of[w.pair_sighting[i]]] = w.pair_cost[i];
        }
    }
    problem.cost = w.cost;
    return problem;
}

void assign_group(std::size_t leader, std::size_t markers, double gate_mm, MatchingWorkspace& w,
                  std::span<std::int16_t> match) {
    if (w.group_size[leader] == 1) {
        double least = gate_mm * gate_mm;
        for (std::size_t i = w.pair_start[leader]; i < w.pair_start[leader + 1]; ++i) {
            if (!(w.pair_cost[i] < least)) continue;
            least = w.pair_cost[i];
            match[leader] = static_cast<std::int16_t>(w.pair_sighting[i]);
        }
        return;
    }
    const AssignmentProblem problem = problem_of(leader, markers, gate_mm * gate_mm, w);
    solve_assignment(problem, w.assignment, w.chosen);
    for (std::size_t r = 0; r < problem.row_count; ++r) {
        if (w.chosen[r] < 0) continue;
        match[w.rows[r]] = static_cast<std::int16_t>(w.columns[static_cast<std::size_t>(w.chosen[r])]);
    }
}

}  // namespace

bool same_names(std::size_t marker_count, const SightingSet& sightings, const Matches& a, const Matches& b) {
    for (std::size_t view = 0; view < sightings.view_count; ++view) {
        if (!std::equal(a[view].begin(), a[view].begin() + marker_count, b[view].begin())) return false;
    }
    return true;
}

void find_left_over(std::size_t marker_count, const SightingSet& sightings, const Matches& matches,
                    LeftOverSightings& left_over) {
    for (std::size_t view = 0; view < sightings.view_count; ++view) {
        left_over[view].clear();
        const std::size_t count = sightings.views[view].size();
        std::array<std::uint64_t, (kMaxSightings + 63) / 64> named{};
        std::size_t names = 0;
        for (std::size_t k = 0; k < marker_count; ++k) {
            if (matches[view][k] < 0) continue;
            const auto j = static_cast<std::size_t>(matches[view][k]);
            named[j / 64] |= std::uint64_t{1} << (j % 64);
            ++names;
        }
        for (std::size_t j = 0; j < count && names < count; ++j) {
            if ((named[j / 64] >> (j % 64) & 1U) != 0) continue;
            const bool kept = left_over[view].push_back(static_cast<std::uint16_t>(j));
            RIG_CHECK(kept);
        }
    }
}

void match_views(std::span<const Vec3> predicted_mm, const SightingSet& sightings, double gate_mm,
                 MatchingWorkspace& workspace, Matches& matches, std::span<const Vec3> velocity_mm_per_us) {
    RIG_CHECK(velocity_mm_per_us.empty() || velocity_mm_per_us.size() == predicted_mm.size());
    for (std::size_t view = 0; view < sightings.view_count; ++view) {
        const ViewSightings& seen = sightings.views[view];
        lay_out(seen.span(), workspace.plane);
        find_pairs(predicted_mm, seen.span(), gate_mm, velocity_mm_per_us, workspace);
        find_groups(predicted_mm.size(), seen.size(), workspace);
        for (std::size_t k = 0; k < predicted_mm.size(); ++k) matches[view][k] = -1;
        for (std::size_t k = 0; k < predicted_mm.size(); ++k) {
            if (workspace.group[k] == k)
                assign_group(k, predicted_mm.size(), gate_mm, workspace, matches[view]);
        }
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
