#include "core/track/pose_votes.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/math.hpp"

namespace rig {

namespace {

// Side of a cell, mm: three of them hold what a rotation half a step off smears.
constexpr double kCellMm = 4.0;
constexpr double kMostRotationSteps = 6.0;  // to either side of an axis
constexpr std::size_t kDepths = 3;

// A face gives a cell some hundred votes. Dots that all lie in one place could give more than 16 bits hold
// (every marker times every sighting of every camera): the count stands still there.
constexpr std::uint16_t kMostVotes = 65535;
static_assert(kMaxMarkers * kMaxSightings * kMaxCameras > kMostVotes);

void add_vote(std::uint16_t& cell) {
    cell = static_cast<std::uint16_t>(cell + (cell != kMostVotes ? 1U : 0U));
}

using Workspace = PoseVotesWorkspace;
using Candidates = BoundedVector<PoseCandidate, kPoseCandidates>;

// Cells of the votes: `count` along each axis, the middle of the middle one is no translation.
struct Grid {
    std::size_t count = 0;
    double cell_mm = 0.0;
    double half_mm = 0.0;
    std::size_t axes = 0;  // 3 for points; 2 for rays, along `across`
    std::array<Vec3, 3> across{Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()};

    [[nodiscard]] std::size_t cells() const { return axes == 3 ? count * count * count : count * count; }
};

Grid grid_for(double reach_mm, std::size_t axes) {
    Grid grid;
    grid.axes = axes;
    // One cell more at either end: the outermost ones are nobody's middle.
    const double wanted = 2.0 * reach_mm / kCellMm + 3.0;
    grid.count = std::min(Workspace::kCells, static_cast<std::size_t>(wanted));
    grid.cell_mm = std::max(kCellMm, 2.0 * reach_mm / static_cast<double>(grid.count - 2));
    grid.half_mm = 0.5 * grid.cell_mm * static_cast<double>(grid.count);
    return grid;
}

// Where the views look, on average: depth is along it.
Vec3 viewing_direction(const SightingSet& sightings) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t view = 0; view < sightings.view_count; ++view) {
        for (const Sighting& sighting : sightings.views[view]) sum += sighting.direction;
    }
    const double length = std::sqrt(sum.dot(sum));
    return length > 1e-9 ? Vec3{sum / length} : Vec3{Vec3::UnitZ()};
}

void span_across(const Vec3& along, Grid& grid) {
    const Vec3 crosswise = std::abs(along[0]) < 0.7 ? Vec3{Vec3::UnitX()} : Vec3{Vec3::UnitY()};
    Vec3 u = crosswise - crosswise.dot(along) * along;
    u /= std::sqrt(u.dot(u));
    grid.across = {u, along.cross(u), along};
}

void vote_points(const Grid& grid, std::size_t markers, const ViewSightings& seen, Workspace& w) {
    const double per_mm = 1.0 / grid.cell_mm;
    const auto count = static_cast<double>(grid.count);
    for (std::size_t k = 0; k < markers; ++k) {
        const Vec3 corner = w.turned_mm[k] - Vec3::Constant(grid.half_mm);
        for (const Sighting& sighting : seen) {
            const double x = (sighting.point_mm[0] - corner[0]) * per_mm;
            if (!(x >= 0.0 && x < count)) continue;
            const double y = (sighting.point_mm[1] - corner[1]) * per_mm;
            if (!(y >= 0.0 && y < count)) continue;
            const double z = (sighting.point_mm[2] - corner[2]) * per_mm;
            if (!(z >= 0.0 && z < count)) continue;
            add_vote(w.votes[(static_cast<std::size_t>(z) * grid.count + static_cast<std::size_t>(y)) *
                                 grid.count +
                             static_cast<std::size_t>(x)]);
        }
    }
}

// The translation across the viewing direction that brings a marker onto a ray. Markers and rays in the axes
// of `across`, so that a pair costs two products.
void vote_rays(const Grid& grid, std::size_t markers, const ViewSightings& seen, Workspace& w) {
    const double per_mm = 1.0 / grid.cell_mm;
    const auto count = static_cast<double>(grid.count);
    for (const Sighting& sighting : seen) {
        const double along = sighting.direction.dot(grid.across[2]);
        if (!(along > 0.1)) continue;
        const double x_slope = sighting.direction.dot(grid.across[0]) / along;
        const double y_slope = sighting.direction.dot(grid.across[1]) / along;
        const double depth_mm = sighting.point_mm.dot(grid.across[2]);
        const double x_mm = sighting.point_mm.dot(grid.across[0]) - depth_mm * x_slope + grid.half_mm;
        const double y_mm = sighting.point_mm.dot(grid.across[1]) - depth_mm * y_slope + grid.half_mm;
        for (std::size_t k = 0; k < markers; ++k) {
            const Vec3& marker = w.turned_mm[k];
            const double x = (x_mm + marker[2] * x_slope - marker[0]) * per_mm;
            if (!(x >= 0.0 && x < count)) continue;
            const double y = (y_mm + marker[2] * y_slope - marker[1]) * per_mm;
            if (!(y >= 0.0 && y < count)) continue;
            add_vote(w.votes[static_cast<std::size_t>(y) * grid.count + static_cast<std::size_t>(x)]);
        }
    }
}

// Sums of three along one axis, whose cells lie `stride` apart; the ends of it keep nothing.
void sum_along(const Grid& grid, std::size_t stride, std::span<const std::uint16_t> from,
               std::span<std::uint16_t> to) {
    const std::size_t line = stride * grid.count;
    for (std::size_t start = 0; start < grid.cells(); start += line) {
        const std::size_t end = start + line - stride;
        for (std::size_t i = start; i < start + stride; ++i) to[i] = 0;
        for (std::size_t i = start + stride; i < end; ++i)
            to[i] = static_cast<std::uint16_t>(std::min<std::uint32_t>(
                kMostVotes, std::uint32_t{from[i - stride]} + from[i] + from[i + stride]));
        for (std::size_t i = end; i < end + stride; ++i) to[i] = 0;
    }
}

// The cell with the most votes in it and its neighbours, and their mean place.
Vec3 peak_of(const Grid& grid, Workspace& w, std::uint32_t& votes) {
    const std::size_t cells = grid.cells();
    const std::span<std::uint16_t> raw(w.votes.data(), cells);
    const std::span<std::uint16_t> sums(w.summed.data(), cells);
    // Summed back and forth between the two grids.
    sum_along(grid, 1, raw, sums);
    sum_along(grid, grid.count, sums, raw);
    std::span<const std::uint16_t> result = raw;
    if (grid.axes == 3) {
        sum_along(grid, grid.count * grid.count, raw, sums);
        result = sums;
    }
    std::size_t best = 0;
    for (std::size_t i = 0; i < cells; ++i) {
        if (result[i] > result[best]) best = i;
    }
    votes = result[best];
    Vec3 offset_mm = Vec3::Zero();
    std::size_t rest = best;
    for (std::size_t axis = 0; axis < grid.axes; ++axis, rest /= grid.count) {
        const double middle = (static_cast<double>(rest % grid.count) + 0.5) * grid.cell_mm - grid.half_mm;
        offset_mm += middle * grid.across[axis];
    }
    return offset_mm;
}

struct Search {
    const ShapeModel& model;
    Grid grid;
    Vec3 centre_mm;  // of the mean face, face frame
    double depth_step_mm = 0.0;
    std::size_t depths = 1;
};

void try_rotation(const Search& search, const Rigid& nominal, const Vec3& turn_rad,
                  const SightingSet& sightings, Workspace& w, Candidates& candidates) {
    const Mat3 turn = rotation_from_vector(turn_rad);
    const Mat3 rotation = turn * nominal.rotation;
    const Vec3 expected = turn * nominal.apply(search.centre_mm);
    for (std::size_t depth = 0; depth < search.depths; ++depth) {
        const double steps = static_cast<double>(depth) - 0.5 * static_cast<double>(search.depths - 1);
        const Vec3 centre = expected + steps * search.depth_step_mm * search.grid.across[2];
        for (std::size_t k = 0; k < search.model.marker_count; ++k) {
            const Vec3 x = rotation * (search.model.mean_mm[k] - search.centre_mm) + centre;
            const auto& axes = search.grid.across;
            w.turned_mm[k] = Vec3{x.dot(axes[0]), x.dot(axes[1]), x.dot(axes[2])};
        }
        std::fill_n(w.votes.begin(), search.grid.cells(), std::uint16_t{0});
        for (std::size_t view = 0; view < sightings.view_count; ++view) {
            if (sightings.from_cameras) {
                vote_rays(search.grid, search.model.marker_count, sightings.views[view], w);
            } else {
                vote_points(search.grid, search.model.marker_count, sightings.views[view], w);
            }
        }
        PoseCandidate candidate;
        const Vec3 offset_mm = peak_of(search.grid, w, candidate.votes);
        candidate.pose.rotation = rotation;
        candidate.pose.translation_mm = centre + offset_mm - rotation * search.centre_mm;
        keep_best(candidates, candidate, [](const PoseCandidate& c) { return c.votes; });
    }
}

}  // namespace

void vote_for_poses(const ShapeModel& model, const PoseVotesConfig& config, const Rigid& nominal,
                    const SightingSet& sightings, PoseVotesWorkspace& workspace, Candidates& candidates) {
    candidates.clear();
    if (model.marker_count == 0) return;
    Vec3 centre = Vec3::Zero();
    for (std::size_t k = 0; k < model.marker_count; ++k) centre += model.mean_mm[k];
    centre /= static_cast<double>(model.marker_count);
    Search search{model, {}, centre};
    // Half a step of rotation that the grid leaves carries the middle of the face along.
    const double slack_mm = 0.5 * config.rotation_step_rad * std::sqrt(centre.dot(centre));
    search.grid = grid_for(config.translation_range_mm + slack_mm, sightings.from_cameras ? 2 : 3);
    if (sightings.from_cameras) {
        span_across(viewing_direction(sightings), search.grid);
        search.depths = kDepths;
        search.depth_step_mm = 0.7 * config.translation_range_mm;
    }
    const double range = config.rotation_range_rad;
    const double step = std::max({config.rotation_step_rad, range / kMostRotationSteps, 1e-3});
    const int steps = static_cast<int>(range / step + 0.5);
    const double farthest = range + 0.5 * step;
    for (int x = -steps; x <= steps; ++x) {
        for (int y = -steps; y <= steps; ++y) {
            for (int z = -steps; z <= steps; ++z) {
                const Vec3 turn =
                    step * Vec3{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
                if (turn.dot(turn) > farthest * farthest) continue;
                try_rotation(search, nominal, turn, sightings, workspace, candidates);
            }
        }
    }
}

}  // namespace rig
