#include "core/track/bootstrap.hpp"

#include <algorithm>
#include <cmath>

namespace rig {

namespace {

// Each round's gate, and how freely the expression may move in it. Found on the public marker streams with
// starts up to 15 mm off: fewer rounds lose the lips, a first gate under 12 mm loses large slips.
struct Round {
    double gate_mm;
    double coefficient_sigma;
};
constexpr std::array<Round, 6> kRounds{
    {{12.0, 0.6}, {10.0, 0.8}, {8.0, 1.0}, {6.0, 1.5}, {4.5, 2.0}, {3.0, 2.0}}};
constexpr double kTicksOfPatience = 6.0;
constexpr double kUsualGhosts = 3.0;  // false dots in a view
constexpr double kGapLimitMm = 2.0;
constexpr double kLeastStepRad = 0.14;  // 8 degrees, of the rotations that are voted for

// Approach to a start before names are sought: nearest sightings, the face's leading modes.
constexpr std::size_t kCoarseModes = 6;
constexpr std::array<double, 5> kApproachGatesMm{16.0, 12.0, 9.0, 7.0, 6.0};
constexpr double kSameStartMm = 2.0;  // starts nearer to each other than this are one
constexpr std::size_t kPosesWithExpressions = 3;
constexpr std::size_t kModesWithExpressions = 2;  // a wide open jaw is one; to either side
constexpr double kExpression = 4.0;               // standard deviations of the mode
constexpr double kApproachScoreMm = 6.0;  // a sighting farther than this from every marker explains nothing

void predict(const ShapeModel& model, const ShapeFit& fit, BootstrapWorkspace& w) {
    for (std::size_t k = 0; k < model.marker_count; ++k) w.predicted_mm[k] = fit.headset_position(model, k);
}

std::span<const Vec3> predicted(const ShapeModel& model, const BootstrapWorkspace& w) {
    return {w.predicted_mm.data(), model.marker_count};
}

// Positions for the fit, trusted to a third of the round's gate: early rounds must not follow wrong names.
void fill_fit_input(const ShapeModel& model, double gate_mm, BootstrapWorkspace& w) {
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

void run_rounds(const ShapeModel& model, const BootstrapConfig& config, const ShapeFit& start,
                const SightingSet& sightings, BootstrapWorkspace& w) {
    w.trial = start;
    ShapePrior prior;
    prior.pose = start.pose;
    prior.coefficients = start.coefficients;
    prior.rotation_sigma_rad = config.rotation_sigma_rad;
    prior.translation_sigma_mm = config.translation_sigma_mm;
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

// The nearest sighting of each marker in each view, several markers to one allowed; and how well the markers
// explain the sightings: the sum over those within kApproachScoreMm of 1 - (distance / kApproachScoreMm)^2.
double match_nearest(std::size_t markers, const SightingSet& sightings, double gate_mm,
                     BootstrapWorkspace& w) {
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

// Draws a candidate near: pose and the leading modes onto the nearest sightings. The score is of the end.
double approach(const BootstrapConfig& config, const SightingSet& sightings, BootstrapWorkspace& w,
                ShapeFit& fit) {
    ShapePrior prior;
    prior.pose = fit.pose;
    prior.coefficients = fit.coefficients;
    prior.rotation_sigma_rad = config.rotation_sigma_rad;
    prior.translation_sigma_mm = config.translation_sigma_mm;
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

// Root mean square distance of the markers of two starts, mm.
double apart_mm(const ShapeModel& coarse, const ShapeFit& a, const ShapeFit& b) {
    double sum = 0.0;
    for (std::size_t k = 0; k < coarse.marker_count; ++k) {
        const Vec3 e = a.headset_position(coarse, k) - b.headset_position(coarse, k);
        sum += e.dot(e);
    }
    return std::sqrt(sum / coarse.marker_count);
}

// Keeps the starts in the order of their scores, one of each kind.
void keep_start(const ShapeFit& fit, double score, BootstrapWorkspace& w) {
    for (std::size_t i = 0; i < w.starts.size(); ++i) {
        if (apart_mm(w.coarse, fit, w.starts[i].fit) > kSameStartMm) continue;
        if (w.starts[i].score >= score) return;
        for (std::size_t j = i; j + 1 < w.starts.size(); ++j) w.starts[j] = w.starts[j + 1];
        w.starts.pop_back();
        break;
    }
    keep_best(w.starts, {fit, score}, [](const BootstrapStart& start) { return start.score; });
}

// Candidates by votes become starts; then the best of them with another expression each.
void find_starts(const ShapeModel& model, const BootstrapConfig& config, const Rigid& nominal,
                 const SightingSet& sightings, BootstrapWorkspace& w) {
    const double range =
        sightings.from_cameras ? config.camera_rotation_range_rad : config.point_rotation_range_rad;
    PoseVotesConfig votes;
    votes.rotation_range_rad = range;
    votes.rotation_step_rad = std::max(kLeastStepRad, 0.5 * range);
    votes.translation_range_mm = config.translation_range_mm;
    vote_for_poses(model, votes, nominal, sightings, w.votes, w.candidates);
    take_leading_modes(model, w.coarse);
    w.starts.clear();
    for (const PoseCandidate& candidate : w.candidates) {
        ShapeFit fit;
        fit.pose = candidate.pose;
        const double score = approach(config, sightings, w, fit);
        keep_start(fit, score, w);
    }
    const std::size_t poses = std::min(w.starts.size(), kPosesWithExpressions);
    std::array<Rigid, kPosesWithExpressions> from;
    for (std::size_t i = 0; i < poses; ++i) from[i] = w.starts[i].fit.pose;
    for (std::size_t i = 0; i < poses; ++i) {
        for (std::size_t j = 0; j < std::min<std::size_t>(kModesWithExpressions, w.coarse.mode_count); ++j) {
            for (const double sign : {1.0, -1.0}) {
                ShapeFit fit;
                fit.pose = from[i];
                fit.coefficients[j] = sign * kExpression;
                const double score = approach(config, sightings, w, fit);
                keep_start(fit, score, w);
            }
        }
    }
}

BootstrapReport judge(const ShapeModel& model, const BootstrapConfig& config, double wanted_explained,
                      const SightingSet& sightings, const BootstrapWorkspace& w) {
    BootstrapReport report;
    std::size_t total = 0;
    std::size_t named = 0;
    for (std::size_t view = 0; view < sightings.view_count; ++view) {
        total += sightings.views[view].size();
        for (std::size_t k = 0; k < model.marker_count; ++k) named += w.matches[view][k] >= 0 ? 1U : 0U;
    }
    double sum = 0.0;
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        if (!w.named.markers[k].seen) continue;
        ++report.seen;
        const Vec3 e = w.named.markers[k].position_mm - w.predicted_mm[k];
        sum += e.dot(e);
    }
    report.explained = total == 0 ? 0.0 : static_cast<double>(named) / static_cast<double>(total);
    report.residual_mm = report.seen == 0 ? 0.0 : std::sqrt(sum / report.seen);
    for (std::size_t j = 0; j < model.mode_count; ++j)
        report.expression += w.trial.coefficients[j] * w.trial.coefficients[j];
    report.found = w.trial.ok && report.seen >= kMinMarkers &&
                   report.seen >= config.accept_seen * static_cast<double>(model.marker_count) &&
                   report.explained >= wanted_explained && report.residual_mm <= config.accept_residual_mm;
    return report;
}

// Fewer sightings left over first, then the smaller residual and the likelier expression.
bool better(const BootstrapReport& a, const BootstrapReport& b) {
    if (a.found != b.found) return a.found;
    const double score_a = a.explained - 0.1 * a.residual_mm - 0.0005 * a.expression;
    const double score_b = b.explained - 0.1 * b.residual_mm - 0.0005 * b.expression;
    return score_a > score_b;
}

// A face that explains nearly everything is believed at once; one that explains less only when some ticks of
// search have found no better.
double wanted_explained(const BootstrapConfig& config, const SightingSet& sightings,
                        const BootstrapState& state) {
    const double patience = 1.0 - static_cast<double>(state.ticks) / kTicksOfPatience;
    double total = 0.0;
    for (std::size_t view = 0; view < sightings.view_count; ++view)
        total += static_cast<double>(sightings.views[view].size());
    // A few false dots are usual, however few true ones there are.
    const double usual = 1.0 - kUsualGhosts * sightings.view_count / std::max(total, 1.0);
    const double at_once = std::min(config.accept_explained_at_once, usual);
    return std::max(config.accept_explained,
                    config.accept_explained + patience * (at_once - config.accept_explained));
}

}  // namespace

BootstrapReport bootstrap(const ShapeModel& model, const BootstrapConfig& config, const Rigid& nominal,
                          const SightingSet& sightings, BootstrapState& state, BootstrapWorkspace& workspace,
                          ShapeFit& fit) {
    BootstrapReport best;
    const double wanted = wanted_explained(config, sightings, state);
    find_starts(model, config, nominal, sightings, workspace);
    const std::size_t count = workspace.starts.size();
    for (int i = 0; i < config.starts_per_frame && count > 0; ++i) {
        run_rounds(model, config, workspace.starts[state.next_start++ % count].fit, sightings, workspace);
        const BootstrapReport report = judge(model, config, wanted, sightings, workspace);
        if (i == 0 || better(report, best)) {
            best = report;
            fit = workspace.trial;
        }
        const bool beyond_doubt = best.explained >= config.accept_explained_at_once &&
                                  best.residual_mm <= 0.5 * config.accept_residual_mm;
        if (best.found && beyond_doubt) break;
    }
    state.ticks = static_cast<std::uint16_t>(std::min(state.ticks + 1, 60000));
    if (best.found) state = BootstrapState{};
    return best;
}

}  // namespace rig
