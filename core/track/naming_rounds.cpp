#include "core/track/naming_rounds.hpp"

#include <algorithm>

namespace rig {

namespace {

// Each round's gate, and how freely the expression may move in it. Found on the public marker streams with
// starts up to 15 mm off: fewer rounds lose the lips, a first gate under 12 mm loses large slips.
struct Round {
    double gate_mm;
    double coefficient_sigma;
};
constexpr std::array<Round, 6> kRounds{
    {{12.0, 0.6}, {10.0, 0.8}, {8.0, 1.0}, {6.0, 1.5}, {4.5, 2.0}, {kNamingGateMm, 2.0}}};
constexpr double kGapLimitMm = 2.0;

// Approach to a start before names are sought: nearest sightings, the face's leading modes.
constexpr std::size_t kCoarseModes = 6;
constexpr std::array<double, 5> kApproachGatesMm{16.0, 12.0, 9.0, 7.0, 6.0};
constexpr double kApproachScoreMm = 6.0;  // a sighting farther than this from every marker explains nothing

void predict(const ShapeModel& model, const ShapeFit& fit, NamingWorkspace& w) {
    for (std::size_t k = 0; k < model.marker_count; ++k) w.predicted_mm[k] = fit.headset_position(model, k);
}

std::span<const Vec3> predicted(const ShapeModel& model, const NamingWorkspace& w) {
    return {w.predicted_mm.data(), model.marker_count};
}

// Positions for the fit, trusted to a third of the round's gate: early rounds must not follow wrong names.
void fill_fit_input(const ShapeModel& model, double gate_mm, NamingWorkspace& w) {
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        const NamedMarker& marker = w.named.markers[k];
        w.positions_mm[k] = marker.position_mm;
        w.informations[k] = Mat3::Zero();
        if (!marker.seen) continue;
        const double sigma_mm = gate_mm / 3.0;
        const double trust = marker.information.trace() / 3.0;
        w.informations[k] = marker.information / (trust * sigma_mm * sigma_mm);
    }
}

// The nearest sighting of each marker in each view, several markers to one allowed; and how well the markers
// explain the sightings: the sum over those within kApproachScoreMm of 1 - (distance / kApproachScoreMm)^2.
double match_nearest(std::size_t markers, const SightingSet& sightings, double gate_mm, NamingWorkspace& w) {
    double score = 0.0;
    for (std::size_t view = 0; view < sightings.view_count; ++view) {
        const ViewSightings& seen = sightings.views[view];
        std::array<double, kMaxSightings> explained{};
        for (std::size_t k = 0; k < markers; ++k) {
            double nearest = gate_mm * gate_mm;
            std::int16_t at = -1;
            for (std::size_t j = 0; j < seen.size(); ++j) {
                const double d2 = seen[j].squared_distance_mm2(w.predicted_mm[k]);
                if (d2 >= nearest) continue;
                nearest = d2;
                at = static_cast<std::int16_t>(j);
            }
            w.matches[view][k] = at;
            if (at < 0) continue;
            double& best = explained[static_cast<std::size_t>(at)];
            best = std::max(best, 1.0 - nearest / (kApproachScoreMm * kApproachScoreMm));
        }
        for (std::size_t j = 0; j < seen.size(); ++j) score += explained[j];
    }
    return score;
}

// What a start tells of the pose; its expression is the caller's.
ShapePrior prior_around(const NamingReach& reach, const Rigid& pose) {
    ShapePrior prior;
    prior.pose = pose;
    prior.rotation_sigma_rad = reach.rotation_sigma_rad;
    prior.translation_sigma_mm = reach.translation_sigma_mm;
    return prior;
}

}  // namespace

void take_leading_modes(const ShapeModel& model, ShapeModel& coarse) {
    coarse.marker_count = model.marker_count;
    coarse.mode_count = std::min<std::uint16_t>(model.mode_count, kCoarseModes);
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        coarse.mean_mm[k] = model.mean_mm[k];
        for (std::size_t j = 0; j < coarse.mode_count; ++j)
            coarse.modes[k * coarse.mode_count + j] = model.modes[k * model.mode_count + j];
    }
    round_modes(coarse);
}

double approach(const NamingReach& reach, const SightingSet& sightings, NamingWorkspace& w, ShapeFit& fit) {
    ShapePrior prior = prior_around(reach, fit.pose);
    prior.coefficients = fit.coefficients;
    prior.coefficient_sigma = 1.0;
    const std::size_t markers = w.coarse.marker_count;
    for (const double gate_mm : kApproachGatesMm) {
        predict(w.coarse, fit, w);
        match_nearest(markers, sightings, gate_mm, w);
        combine_views(predicted(w.coarse, w), sightings, gate_mm, w.matches, w.named);
        fill_fit_input(w.coarse, gate_mm, w);
        const ShapeFit before = fit;
        fit_shape(w.coarse, {w.positions_mm.data(), markers}, {w.informations.data(), markers}, prior, 1,
                  before, w.fit, fit);
    }
    predict(w.coarse, fit, w);
    return match_nearest(markers, sightings, kApproachScoreMm, w);
}

void run_rounds(const ShapeModel& model, const NamingReach& reach, const ShapeFit& start,
                const SightingSet& sightings, NamingWorkspace& w) {
    w.trial = start;
    ShapePrior prior = prior_around(reach, start.pose);
    prior.coefficients = start.coefficients;
    for (const Round& round : kRounds) {
        predict(model, w.trial, w);
        match_views(predicted(model, w), sightings, round.gate_mm, w.matching, w.matches);
        combine_views(predicted(model, w), sightings, kGapLimitMm, w.matches, w.named);
        fill_fit_input(model, round.gate_mm, w);
        prior.coefficient_sigma = round.coefficient_sigma;
        if (round.coefficient_sigma > 1.0) prior.coefficients.fill(0.0);  // near enough: the mean draws again
        const ShapeFit before = w.trial;
        fit_shape(model, {w.positions_mm.data(), model.marker_count},
                  {w.informations.data(), model.marker_count}, prior, 2, before, w.fit, w.trial);
    }
    predict(model, w.trial, w);
    match_views(predicted(model, w), sightings, kRounds.back().gate_mm, w.matching, w.matches);
    combine_views(predicted(model, w), sightings, kGapLimitMm, w.matches, w.named);
}

void fit_to_names(const ShapeModel& model, const NamingReach& reach, const ShapeFit& start,
                  const SightingSet& sightings, const Matches& matches, NamingWorkspace& w) {
    ShapePrior prior = prior_around(reach, start.pose);
    prior.coefficient_sigma = kRounds.back().coefficient_sigma;
    w.matches = matches;
    predict(model, start, w);
    combine_views(predicted(model, w), sightings, kGapLimitMm, w.matches, w.named);
    fill_fit_input(model, kRounds.back().gate_mm, w);
    fit_shape(model, {w.positions_mm.data(), model.marker_count}, {w.informations.data(), model.marker_count},
              prior, 2, start, w.fit, w.trial);
    predict(model, w.trial, w);
}

double naming_cost_mm2(const ShapeModel& model, const SightingSet& sightings, const Matches& matches,
                       const NamingWorkspace& w) {
    constexpr double kMost = kNamingGateMm * kNamingGateMm;
    double cost = 0.0;
    for (std::size_t view = 0; view < sightings.view_count; ++view) {
        const ViewSightings& seen = sightings.views[view];
        cost += kMost * static_cast<double>(seen.size());
        for (std::size_t k = 0; k < model.marker_count; ++k) {
            const std::int16_t at = matches[view][k];
            if (at < 0) continue;
            const double d2 = seen[static_cast<std::size_t>(at)].squared_distance_mm2(w.predicted_mm[k]);
            cost -= kMost - std::min(kMost, d2);
        }
    }
    return cost;
}

}  // namespace rig
