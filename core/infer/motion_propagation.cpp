#include "core/infer/motion_propagation.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"
#include "core/base/dense.hpp"

namespace rig {

namespace {

bool share_a_marker(const MarkerSetModel& a, const MarkerSetModel& b) {
    std::size_t i = 0;
    std::size_t j = 0;
    while (i < a.markers.size() && j < b.markers.size()) {
        if (a.markers[i] == b.markers[j]) return true;
        if (a.markers[i] < b.markers[j]) {
            ++i;
        } else {
            ++j;
        }
    }
    return false;
}

bool holds_known(const MarkerSetModel& set, std::span<const bool> known) {
    return std::any_of(set.markers.begin(), set.markers.end(), [&](std::uint16_t k) { return known[k]; });
}

// Levels rise, so the first set that holds a known marker is the coarsest of them. -1: none.
int first_set(std::span<const MarkerSetModel> sets, std::span<const bool> known, bool begins_fine) {
    int chosen = -1;
    for (std::size_t f = 0; f < sets.size(); ++f) {
        if (!holds_known(sets[f], known)) continue;
        const bool finer = chosen < 0 || sets[f].level > sets[static_cast<std::size_t>(chosen)].level;
        if (chosen < 0 || (begins_fine && finer)) chosen = static_cast<int>(f);
    }
    return chosen;
}

// Proj(dV, F) and the update of dV with it.
void project(const MarkerSetModel& set, std::uint16_t most_modes, PropagationWorkspace& w,
             std::span<Vec3> displacement_mm) {
    const std::size_t rows = 3U * set.marker_count;
    for (std::size_t r = 0; r < rows; ++r) {
        w.projected_mm[r] = static_cast<double>(set.mean_mm[r]);
        w.offset_mm[r] =
            displacement_mm[set.markers[r / 3]][static_cast<Eigen::Index>(r % 3)] - w.projected_mm[r];
    }
    for (std::size_t j = 0; j < std::min(set.mode_count, most_modes); ++j) {
        const float* mode = set.modes.data() + j * rows;
        const double along = dot(mode, w.offset_mm.data(), rows);
        for (std::size_t r = 0; r < rows; ++r) w.projected_mm[r] += along * static_cast<double>(mode[r]);
    }
    for (std::size_t r = 0; r < rows; ++r)
        displacement_mm[set.markers[r / 3]][static_cast<Eigen::Index>(r % 3)] = w.projected_mm[r];
}

// The coarser neighbours first, then the finer ones, as the source's recursion goes. -1: all are visited.
int next_neighbour(std::span<const MarkerSetModel> sets, std::size_t from, PropagationWorkspace& w) {
    const std::size_t count = sets.size();
    while (w.next[from] < 2 * count) {
        const bool coarser = w.next[from] < count;
        const std::size_t g = w.next[from]++ % count;
        const bool wanted = coarser ? sets[g].level < sets[from].level : sets[g].level > sets[from].level;
        if (w.neighbours[from][g] && wanted && !w.visited[g]) return static_cast<int>(g);
    }
    return -1;
}

// MotionPropagationFeaturePointSet, its recursion as a path: no deeper than there are sets.
std::uint16_t sweep(std::span<const MarkerSetModel> sets, std::size_t start, const PropagationConfig& config,
                    PropagationWorkspace& w, std::span<Vec3> displacement_mm) {
    w.visited.fill(false);
    w.next.fill(0);
    std::size_t depth = 0;
    std::uint16_t visits = 0;
    const auto visit = [&](std::size_t f) {
        w.visited[f] = true;
        project(sets[f], config.most_modes, w, displacement_mm);
        w.path[depth++] = static_cast<std::uint8_t>(f);
        ++visits;
    };
    visit(start);
    while (depth > 0) {
        const int next = next_neighbour(sets, w.path[depth - 1], w);
        if (next < 0) {
            --depth;
        } else {
            visit(static_cast<std::size_t>(next));
        }
    }
    return visits;
}

}  // namespace

void prepare_propagation(std::span<const MarkerSetModel> sets, PropagationWorkspace& w) {
    RIG_CHECK(sets.size() <= kMaxMarkerSets);
    for (std::size_t f = 0; f < sets.size(); ++f) {
        for (std::size_t g = 0; g < sets.size(); ++g) {
            const int levels = static_cast<int>(sets[f].level) - static_cast<int>(sets[g].level);
            w.neighbours[f][g] = (levels == 1 || levels == -1) && share_a_marker(sets[f], sets[g]);
        }
    }
}

PropagationReport propagate_motion(std::span<const MarkerSetModel> sets, std::span<const bool> known,
                                   const PropagationConfig& config, PropagationWorkspace& w,
                                   std::span<Vec3> displacement_mm) {
    RIG_CHECK(sets.size() <= kMaxMarkerSets && known.size() == displacement_mm.size() &&
              known.size() <= kMaxMarkers);
    PropagationReport report;
    std::size_t count = 0;
    for (std::size_t k = 0; k < known.size(); ++k) {
        w.given_mm[k] = known[k] ? displacement_mm[k] : Vec3{Vec3::Zero()};
        if (!known[k]) displacement_mm[k] = Vec3::Zero();
        if (known[k]) ++count;
    }
    const int start = first_set(sets, known, config.begins_fine);
    if (start < 0) return report;
    double before_mm = 0.0;
    for (std::uint16_t s = 0; s < config.most_sweeps && !report.settled; ++s) {
        for (std::size_t k = 0; k < known.size(); ++k) {
            if (known[k]) displacement_mm[k] = w.given_mm[k];
        }
        report.sets_visited = sweep(sets, static_cast<std::size_t>(start), config, w, displacement_mm);
        double sum = 0.0;
        for (std::size_t k = 0; k < known.size(); ++k) {
            if (!known[k]) continue;
            const Vec3 error = displacement_mm[k] - w.given_mm[k];
            sum += std::sqrt(error.dot(error));
        }
        report.known_error_mm = sum / static_cast<double>(count);
        ++report.sweeps;
        report.settled = s > 0 && before_mm - report.known_error_mm < config.least_progress_mm;
        before_mm = report.known_error_mm;
    }
    return report;
}

}  // namespace rig
