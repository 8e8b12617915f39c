#include "core/track/second_opinion.hpp"

#include <algorithm>
#include <array>

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
constexpr double kLeastGainMm2 = 0.5 * kNamingGateMm * kNamingGateMm;
constexpr double kMostShare = 0.9;  // of what the present names leave

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

bool same_names(const ShapeModel& model, const SightingSet& sightings, const Matches& a, const Matches& b) {
    for (std::size_t view = 0; view < sightings.view_count; ++view) {
        if (!std::equal(a[view].begin(), a[view].begin() + model.marker_count, b[view].begin())) return false;
    }
    return true;
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

}  // namespace

void ask_for_opinions(SecondOpinionState& state) {
    state.left = kOpinions;
    state.suspicion = 0;
}

void take_opinion(SecondOpinionState& state) {
    state.suspicion = 0;
    state.pause = 0;
    state.next_pause = 0;
}

void suspect(const ShapeModel& model, std::span<const Vec3> predicted_mm, const SightingSet& sightings,
             const Matches& matches, const LeftOverSightings& left_over, bool odd,
             SecondOpinionState& state) {
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
                    const Matches& matches, std::uint8_t opinion, NamingWorkspace& w) {
    fit_to_names(model, kReach, fit, sightings, matches, w);
    const double present_mm2 = naming_cost_mm2(model, sightings, matches, w);
    take_leading_modes(model, w.coarse);
    ShapeFit start = start_of(w.coarse, fit, opinion);
    approach(kReach, sightings, w, start);
    run_rounds(model, kReach, start, sightings, w);
    if (!w.trial.ok || same_names(model, sightings, matches, w.matches)) return false;
    const double other_mm2 = naming_cost_mm2(model, sightings, w.matches, w);
    return other_mm2 + kLeastGainMm2 < present_mm2 && other_mm2 < kMostShare * present_mm2;
}

}  // namespace rig
