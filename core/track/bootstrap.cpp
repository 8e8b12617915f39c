#include "core/track/bootstrap.hpp"

#include <cmath>

namespace rig {

namespace {

// Each round's gate, and how freely the expression may move in it. Found on the public marker streams with
// starts up to 15 mm off: fewer rounds lose the lips, a first gate under 12 mm loses large slips.
struct Round {
    double gate_mm;
    double coefficient_sigma;
};
constexpr std::array<Round, 9> kRounds{{{16.0, 0.25},
                                        {14.0, 0.4},
                                        {12.0, 0.6},
                                        {10.0, 0.8},
                                        {8.0, 1.0},
                                        {6.0, 1.5},
                                        {5.0, 2.0},
                                        {4.0, 2.0},
                                        {3.0, 2.0}}};
constexpr double kGapLimitMm = 2.0;

// Start i of the grid: the nominal pose first, then its 26 neighbours, nearest first.
Vec3 start_offset(std::size_t index, double spacing_mm) {
    static constexpr std::array<std::array<int, 3>, 27> kOrder{
        {{0, 0, 0},   {0, 1, 0},   {0, -1, 0}, {1, 0, 0},   {-1, 0, 0},  {0, 0, 1},   {0, 0, -1},
         {1, 1, 0},   {-1, 1, 0},  {1, -1, 0}, {-1, -1, 0}, {0, 1, 1},   {0, -1, 1},  {0, 1, -1},
         {0, -1, -1}, {1, 0, 1},   {-1, 0, 1}, {1, 0, -1},  {-1, 0, -1}, {1, 1, 1},   {-1, 1, 1},
         {1, -1, 1},  {-1, -1, 1}, {1, 1, -1}, {-1, 1, -1}, {1, -1, -1}, {-1, -1, -1}}};
    const auto& at = kOrder[index % kOrder.size()];
    return spacing_mm *
           Vec3{static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2])};
}

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

void run_rounds(const ShapeModel& model, const BootstrapConfig& config, const Rigid& start,
                const SightingSet& sightings, BootstrapWorkspace& w) {
    w.trial = ShapeFit{};
    w.trial.pose = start;
    ShapePrior prior;
    prior.pose = start;
    prior.rotation_sigma_rad = config.rotation_sigma_rad;
    prior.translation_sigma_mm = config.translation_sigma_mm;
    for (const Round& round : kRounds) {
        predict(model, w.trial, w);
        match_views(predicted(model, w), sightings, round.gate_mm, w.matching, w.matches);
        combine_views(predicted(model, w), sightings, kGapLimitMm, w.matches, w.named);
        fill_fit_input(model, round.gate_mm, w);
        prior.coefficient_sigma = round.coefficient_sigma;
        const ShapeFit before = w.trial;
        fit_shape(model, {w.positions_mm.data(), model.marker_count},
                  {w.informations.data(), model.marker_count}, prior, 2, before, w.fit, w.trial);
    }
    predict(model, w.trial, w);
    match_views(predicted(model, w), sightings, kRounds.back().gate_mm, w.matching, w.matches);
    combine_views(predicted(model, w), sightings, kGapLimitMm, w.matches, w.named);
}

BootstrapReport judge(const ShapeModel& model, const BootstrapConfig& config, const SightingSet& sightings,
                      const BootstrapWorkspace& w) {
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
    report.found = w.trial.ok && report.seen >= kMinMarkers &&
                   report.seen >= config.accept_seen * static_cast<double>(model.marker_count) &&
                   report.explained >= config.accept_explained &&
                   report.residual_mm <= config.accept_residual_mm;
    return report;
}

// Fewer sightings left over first, then the smaller residual.
bool better(const BootstrapReport& a, const BootstrapReport& b) {
    if (a.found != b.found) return a.found;
    const double score_a = a.explained - 0.1 * a.residual_mm;
    const double score_b = b.explained - 0.1 * b.residual_mm;
    return score_a > score_b;
}

}  // namespace

BootstrapReport bootstrap(const ShapeModel& model, const BootstrapConfig& config, const Rigid& nominal,
                          const SightingSet& sightings, BootstrapState& state, BootstrapWorkspace& workspace,
                          ShapeFit& fit) {
    BootstrapReport best;
    for (int i = 0; i < config.starts_per_frame; ++i) {
        Rigid start = nominal;
        start.translation_mm += start_offset(state.next_start++, config.start_spacing_mm);
        run_rounds(model, config, start, sightings, workspace);
        const BootstrapReport report = judge(model, config, sightings, workspace);
        if (i == 0 || better(report, best)) {
            best = report;
            fit = workspace.trial;
        }
    }
    if (best.found) state.next_start = 0;
    return best;
}

}  // namespace rig
