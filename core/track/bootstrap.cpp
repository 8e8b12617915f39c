#include "core/track/bootstrap.hpp"

#include <algorithm>
#include <cmath>

namespace rig {

namespace {

constexpr double kTicksOfPatience = 6.0;
constexpr double kUsualGhosts = 3.0;    // false dots in a view
constexpr double kBesideMm = 15.0;      // from a marker to a sighting that may be its own
constexpr double kLeastStepRad = 0.14;  // 8 degrees, of the rotations that are voted for

constexpr double kSameStartMm = 2.0;  // starts nearer to each other than this are one
constexpr std::size_t kPosesWithExpressions = 3;
constexpr std::size_t kModesWithExpressions = 2;  // a wide open jaw is one; to either side
constexpr double kExpression = 4.0;               // standard deviations of the mode

NamingReach reach_of(const BootstrapConfig& config) {
    return {config.rotation_sigma_rad, config.translation_sigma_mm};
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
        if (apart_mm(w.naming.coarse, fit, w.starts[i].fit) > kSameStartMm) continue;
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
    take_leading_modes(model, w.naming.coarse);
    w.starts.clear();
    for (const PoseCandidate& candidate : w.candidates) {
        ShapeFit fit;
        fit.pose = candidate.pose;
        const double score = approach(reach_of(config), sightings, w.naming, fit);
        keep_start(fit, score, w);
    }
    const std::size_t poses = std::min(w.starts.size(), kPosesWithExpressions);
    std::array<Rigid, kPosesWithExpressions> from;
    for (std::size_t i = 0; i < poses; ++i) from[i] = w.starts[i].fit.pose;
    for (std::size_t i = 0; i < poses; ++i) {
        for (std::size_t j = 0; j < std::min<std::size_t>(kModesWithExpressions, w.naming.coarse.mode_count);
             ++j) {
            for (const double sign : {1.0, -1.0}) {
                ShapeFit fit;
                fit.pose = from[i];
                fit.coefficients[j] = sign * kExpression;
                const double score = approach(reach_of(config), sightings, w.naming, fit);
                keep_start(fit, score, w);
            }
        }
    }
}

BootstrapReport judge(const ShapeModel& model, const BootstrapConfig& config, double wanted_explained,
                      const SightingSet& sightings, const NamingWorkspace& w) {
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

bool agrees(const ShapeModel& model, const SightingSet& sightings, const Matches& a, const Matches& b) {
    for (std::size_t view = 0; view < sightings.view_count; ++view)
        if (!std::equal(a[view].begin(), a[view].begin() + model.marker_count, b[view].begin())) return false;
    return true;
}

// No sighting without a name lies beside a marker without one: they are all ghosts.
bool nothing_else_to_name(const ShapeModel& model, const SightingSet& sightings, const NamingWorkspace& w) {
    LeftOverSightings left_over;
    find_left_over(model.marker_count, sightings, w.matches, left_over);
    for (std::size_t view = 0; view < sightings.view_count; ++view) {
        for (const std::uint16_t j : left_over[view]) {
            for (std::size_t k = 0; k < model.marker_count; ++k) {
                if (w.matches[view][k] < 0 &&
                    sightings.views[view][j].squared_distance_mm2(w.predicted_mm[k]) < kBesideMm * kBesideMm)
                    return false;
            }
        }
    }
    return true;
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
    bool contended = false;  // by a start that explains enough ...
    bool by_best = false;    // ... and is the best one
    bool only = true;        // names that the tick's starts come to, and no sighting that asks for others
    for (int i = 0; i < config.starts_per_frame && count > 0; ++i) {
        NamingWorkspace& naming = workspace.naming;
        run_rounds(model, reach_of(config), workspace.starts[state.next_start++ % count].fit, sightings,
                   naming);
        const BootstrapReport report = judge(model, config, wanted, sightings, naming);
        const bool contends = judge(model, config, config.accept_explained, sightings, naming).found;
        if (contends) {
            if (!contended) workspace.first_names = naming.matches;
            contended = true;
            only = only && agrees(model, sightings, workspace.first_names, naming.matches) &&
                   nothing_else_to_name(model, sightings, naming);
        }
        if (i == 0 || better(report, best)) {
            best = report;
            by_best = contends;
            fit = naming.trial;
        }
        const bool beyond_doubt = best.explained >= config.accept_explained_at_once &&
                                  best.residual_mm <= 0.5 * config.accept_residual_mm;
        if (best.found && beyond_doubt) break;
    }
    if (by_best && only && best.residual_mm <= 0.5 * config.accept_residual_mm) best.found = true;
    state.ticks = static_cast<std::uint16_t>(std::min(state.ticks + 1, 60000));
    if (best.found) state = BootstrapState{};
    return best;
}

}  // namespace rig
