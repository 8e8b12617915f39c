#include "core/track/second_opinion.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "core/base/bounded_vector.hpp"
#include "core/base/check.hpp"

namespace rig {

namespace {

// The rest of the face tells the pose well: the reach is a tracked frame's, jolts included.
constexpr NamingReach kReach{0.03, 3.0};
struct Expression {
    std::size_t mode;
    double sigmas;
};
constexpr std::array<Expression, kOpinions - 2> kExpressions{
    {{0, 4.0}, {0, -4.0}, {0, 6.0}, {2, 4.0}, {2, -4.0}, {1, 4.0}, {1, -4.0}, {0, -6.0}}};
constexpr double kBesideMm = 15.0;  // from a marker to a sighting that may be its own
constexpr std::uint8_t kSuspicious = 8;
constexpr std::uint16_t kFirstPause = 8;  // frames; doubled up to the longest
constexpr std::uint16_t kLongestPause = 960;
// Frames, besides twice the pause that would have followed: the next opinion is asked for before that.
constexpr int kTakenLately = 60;
constexpr double kLeastGainMm2 = 0.5 * kNamingGateMm * kNamingGateMm;
constexpr double kMostShare = 0.9;   // of what the present names leave
constexpr double kRivalMm = 6.0;     // from a sighting to the face's place of an unseen marker
constexpr double kLeastOffMm = 0.3;  // of a named marker from its sighting, to be doubted
// In a fit's objective, sighting and expression together. Found on 140 synthetic starts, one and two cameras:
// of names that were right none gained more than 0.3, of wrong ones most 1.5 to 11.
constexpr double kRivalGain = 1.0;
constexpr std::size_t kMostRivals = 4;  // of an opinion

bool left_over_beside_unseen(const ShapeModel& model, std::span<const Vec3> predicted_mm,
                             const ViewSightings& seen, std::span<const std::uint16_t> left_over,
                             const std::array<std::int16_t, kMaxMarkers>& matches) {
    for (const std::uint16_t j : left_over) {
        for (std::size_t k = 0; k < model.marker_count; ++k) {
            if (matches[k] < 0 && seen[j].squared_distance_mm2(predicted_mm[k]) < kBesideMm * kBesideMm)
                return true;
        }
    }
    return false;
}

ShapeFit start_of(const ShapeModel& coarse, const ShapeFit& fit, std::uint8_t opinion) {
    ShapeFit start;
    start.pose = fit.pose;
    if (opinion == 0) {
        std::copy_n(fit.coefficients.begin(), coarse.mode_count, start.coefficients.begin());
    } else if (opinion > 1) {
        const Expression& other = kExpressions[opinion - 2U];
        if (other.mode < coarse.mode_count) start.coefficients[other.mode] = other.sigmas;
    }
    return start;
}

struct Rival {
    std::size_t view = 0;
    std::size_t named = 0;
    std::size_t unseen = 0;
};
using Rivals = BoundedVector<Rival, kMostRivals>;

bool is_seen(const SightingSet& sightings, const Matches& matches, std::size_t marker, std::size_t but_view) {
    for (std::size_t view = 0; view < sightings.view_count; ++view)
        if (view != but_view && matches[view][marker] >= 0) return true;
    return false;
}

// Calls visit(rival) for each, in the order of the unseen markers. predicted_mm: of the face that was fitted
// to the names.
template <typename Visit>
void for_each_rival(const ShapeModel& model, const SightingSet& sightings, const Matches& matches,
                    std::span<const bool> off_place, std::span<const Vec3> predicted_mm, const Visit& visit) {
    for (std::size_t j = 0; j < model.marker_count; ++j) {
        if (is_seen(sightings, matches, j, kMaxCameras)) continue;
        for (std::size_t view = 0; view < sightings.view_count; ++view) {
            for (std::size_t k = 0; k < model.marker_count; ++k) {
                if (matches[view][k] < 0 || (!off_place.empty() && off_place[k])) continue;
                const Sighting& seen = sightings.views[view][static_cast<std::size_t>(matches[view][k])];
                if (seen.squared_distance_mm2(predicted_mm[j]) > kRivalMm * kRivalMm ||
                    seen.squared_distance_mm2(predicted_mm[k]) < kLeastOffMm * kLeastOffMm ||
                    is_seen(sightings, matches, k, view))
                    continue;
                visit(Rival{view, k, j});
            }
        }
    }
}

// Those that one opinion looks at. Each begins at its own share of all, so that many rivals at the first
// markers do not keep the last ones from being heard.
void find_rivals(const ShapeModel& model, const SightingSet& sightings, const Matches& matches,
                 std::span<const bool> off_place, std::span<const Vec3> predicted_mm, std::uint8_t opinion,
                 Rivals& rivals) {
    std::size_t count = 0;
    for_each_rival(model, sightings, matches, off_place, predicted_mm, [&](const Rival&) { ++count; });
    rivals.clear();
    const std::size_t first = opinion * count / kOpinions;
    std::size_t at = 0;
    for_each_rival(model, sightings, matches, off_place, predicted_mm, [&](const Rival& rival) {
        const std::size_t after_first = (at++ + count - first) % count;
        if (after_first >= kMostRivals) return;
        const bool kept = rivals.push_back(rival);
        RIG_CHECK(kept);
    });
}

// True: one of the rivals has a better claim, the face's objective is less than `wanted`; the names and the
// face are then in the workspace.
bool hear_rivals(const ShapeModel& model, const ShapeFit& fit, const SightingSet& sightings,
                 const Matches& matches, const Rivals& rivals, double wanted, NamingWorkspace& w) {
    for (const Rival& rival : rivals) {
        Matches other = matches;
        std::swap(other[rival.view][rival.named], other[rival.view][rival.unseen]);
        fit_to_names(model, kReach, fit, sightings, other, w);
        if (w.trial.ok && w.trial.objective < wanted) return true;
    }
    return false;
}

}  // namespace

void ask_for_opinions(SecondOpinionState& state) {
    state.left = kOpinions;
    state.suspicion = 0;
}

void take_opinion(SecondOpinionState& state) {
    state.suspicion = 0;
    if (state.taken_lately == 0) {
        state.pause = 0;
        state.next_pause = 0;
    }
    state.taken_lately = static_cast<std::uint16_t>(kTakenLately + 2 * state.next_pause);
}

void suspect(const ShapeModel& model, std::span<const Vec3> predicted_mm, const SightingSet& sightings,
             const Matches& matches, const LeftOverSightings& left_over, bool odd,
             SecondOpinionState& state) {
    if (state.taken_lately > 0) --state.taken_lately;
    if (state.pause > 0) {
        --state.pause;
        return;
    }
    if (state.left > 0) return;
    bool doubtful = odd;
    for (std::size_t view = 0; view < sightings.view_count && !doubtful; ++view) {
        doubtful = left_over_beside_unseen(model, predicted_mm, sightings.views[view], left_over[view].span(),
                                           matches[view]);
    }
    if (!doubtful) {
        state.suspicion = static_cast<std::uint8_t>(std::max(0, state.suspicion - 1));
        if (state.next_pause > 0) --state.next_pause;
        return;
    }
    if (++state.suspicion < kSuspicious) return;
    ask_for_opinions(state);
    state.next_pause =
        static_cast<std::uint16_t>(std::clamp<int>(2 * state.next_pause, kFirstPause, kLongestPause));
    state.pause = state.next_pause;
}

bool second_opinion(const ShapeModel& model, const ShapeFit& fit, const SightingSet& sightings,
                    const Matches& matches, std::span<const bool> off_place, std::uint8_t opinion,
                    NamingWorkspace& w) {
    fit_to_names(model, kReach, fit, sightings, matches, w);
    const double present_mm2 = naming_cost_mm2(model, sightings, matches, w);
    const double wanted = w.trial.objective - kRivalGain;
    Rivals rivals;
    find_rivals(model, sightings, matches, off_place, {w.predicted_mm.data(), model.marker_count}, opinion,
                rivals);
    take_leading_modes(model, w.coarse);
    ShapeFit start = start_of(w.coarse, fit, opinion);
    approach(kReach, sightings, w, start);
    run_rounds(model, kReach, start, sightings, w);
    if (w.trial.ok && !same_names(model.marker_count, sightings, matches, w.matches)) {
        const double other_mm2 = naming_cost_mm2(model, sightings, w.matches, w);
        if (other_mm2 + kLeastGainMm2 < present_mm2 && other_mm2 < kMostShare * present_mm2) return true;
    }
    return hear_rivals(model, fit, sightings, matches, rivals, wanted, w);
}

}  // namespace rig
