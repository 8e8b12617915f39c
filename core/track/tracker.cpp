#include "core/track/tracker.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/base/check.hpp"
#include "core/base/elapsed.hpp"
#include "core/base/math.hpp"

namespace rig {

namespace {

constexpr double kBiasLearning =
    0.02;  // per frame: follows a head the model does not quite fit within a second
// Names need the face to a tenth of a millimetre; its fitted markers' own deviation is half of that.
constexpr ShapeFitLimits kFitLimits{6, 0.3};
constexpr double kOffPlaceMm = 1.0;  // beyond what a face that the model does not quite fit makes usual
constexpr int kReturnWindow = 3;  // frames in which one who came back a little off has to be seen once more
constexpr int kMostReturnFrames = 31;

std::span<const Vec3> predicted(const ShapeModel& model, const TrackerWorkspace& w) {
    return {w.predicted_mm.data(), model.marker_count};
}

ShapePrior prior_from(const TrackerConfig& config, const TrackerState& state) {
    ShapePrior prior;
    prior.pose = state.fit.pose;
    prior.rotation_sigma_rad = config.pose_sigma_rad;
    prior.translation_sigma_mm = config.pose_sigma_mm;
    prior.coefficients = state.fit.coefficients;
    prior.coefficient_sigma = config.expression_sigma;
    return prior;
}

// Where each marker should be: its own motion goes on when it was seen just now, otherwise the face tells.
void predict_motion(const ShapeModel& model, const TrackerConfig& config, const TrackerState& state,
                    TrackerWorkspace& w) {
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        w.predicted_mm[k] = state.missed[k] == 0
                                ? Vec3{state.position_mm[k] + config.velocity_keep * state.velocity_mm[k]}
                                : Vec3{state.fit.headset_position(model, k) + state.bias_mm[k]};
    }
}

// From the face that was fitted last.
void predict_face(const ShapeModel& model, const TrackerState& state, TrackerWorkspace& w) {
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        w.predicted_mm[k] = w.fit.headset_mm[k] + state.bias_mm[k];
    }
}

// What a rolling shutter's rows are corrected by, over one round of naming: empty when there is none, or when
// the last frame is too far away to tell a velocity (F34: outside [0.25, 4] frames). `before_mm`
// [marker_count]: the face in the last frame; empty: as state.fit has it.
std::span<const Vec3> row_velocity(const ShapeModel& model, const TrackerConfig& config,
                                   const SightingSet& sightings, const TrackerState& state,
                                   const ShapeFit* fitted, std::span<const Vec3> before_mm,
                                   TrackerWorkspace& w) {
    if (!sightings.row_delays || !config.correct_rows) return {};
    const double frame_us = 1e6 / config.rate_hz;
    const auto since_us = static_cast<double>(elapsed_us(state.capture_us, sightings.capture_us));
    if (since_us < 0.25 * frame_us || since_us > 4.0 * frame_us) return {};
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        // The fitted face's step has less noise than a marker's own, and is a frame newer than the last one.
        Vec3 step = state.velocity_mm[k];
        if (fitted != nullptr) {
            const Vec3 from_mm = before_mm.empty() ? state.fit.headset_position(model, k) : before_mm[k];
            step = fitted->headset_position(model, k) - from_mm;
        }
        w.velocity_mm_per_us[k] = step / since_us;
    }
    return {w.velocity_mm_per_us.data(), model.marker_count};
}

double residual_of(const TrackerWorkspace& w, const TrackerState& state, const NamedMarkers& named,
                   std::size_t k) {
    const Vec3 e = named.markers[k].position_mm - w.fit.headset_mm[k] - state.bias_mm[k];
    // Only what was measured counts: the depth along a single ray was predicted.
    return measured_length_mm(named.markers[k].information, e);
}

// Fit, then again without the names that the first fit contradicts.
void fit_face(const ShapeModel& model, const TrackerConfig& config, TrackerState& state,
              const NamedMarkers& named, TrackerWorkspace& w) {
    const ShapePrior prior = prior_from(config, state);
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        const NamedMarker& marker = named.markers[k];
        w.positions_mm[k] = marker.position_mm - state.bias_mm[k];
        w.informations[k] = marker.seen ? marker.information : Mat3{Mat3::Zero()};
        if (state.watch.trouble[k] == MarkerTrouble::kSlid) w.informations[k] *= kSlidTrust;
    }
    const std::span<const Vec3> positions(w.positions_mm.data(), model.marker_count);
    const std::span<const Mat3> informations(w.informations.data(), model.marker_count);
    w.fitted_matches = w.matches;
    fit_shape(model, positions, informations, prior, kFitLimits, state.fit, state.memory, w.fit, w.next);
    bool doubted = false;
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        if (!named.markers[k].seen) continue;
        const double residual = residual_of(w, state, named, k);
        if (residual <= config.outlier_mm) continue;
        // A doubted name keeps a little weight: the wrong fit may be what contradicts a right name.
        const double ratio = config.outlier_mm / residual;
        w.informations[k] *= 0.05 * ratio * ratio;
        doubted = true;
    }
    if (!doubted) return;
    const ShapeFit before = w.next;
    fit_shape(model, positions, informations, prior, kFitLimits, before, state.memory, w.fit, w.next);
}

void withhold(std::size_t k, NamedMarkers& named, TrackerWorkspace& w) {
    named.markers[k] = NamedMarker{};
    for (auto& view : w.matches) view[k] = -1;
}

// Who comes back a little off waits a frame, who had come off the face half a second. Frames in between that
// do not show it in its place put off its return without beginning it anew: a marker may flicker.
void hold_returns(const ShapeModel& model, const TrackerConfig& config, TrackerState& state,
                  NamedMarkers& named, TrackerWorkspace& w) {
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        std::uint64_t& frames = state.returning[k];
        if (state.missed[k] == 0) {
            frames = 0;
            continue;
        }
        frames <<= 1U;
        if (!named.markers[k].seen) continue;
        int needed = residual_of(w, state, named, k) > config.return_mm ? 1 : 0;
        int within = kReturnWindow;
        if (state.watch.trouble[k] == MarkerTrouble::kFallen) {
            needed = std::min<int>(config.fallen_return_frames, kMostReturnFrames);
            within = 2 * needed;
        }
        const std::uint64_t recent = frames << static_cast<unsigned>(63 - within);
        frames |= 1U;
        if (std::popcount(recent) < needed) withhold(k, named, w);
    }
}

// Names that do not lie on the fitted face are taken back.
void reject_outliers(const ShapeModel& model, const TrackerConfig& config, const TrackerState& state,
                     NamedMarkers& named, TrackerWorkspace& w, TrackerReport& report) {
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        if (!named.markers[k].seen || residual_of(w, state, named, k) <= config.outlier_mm) continue;
        withhold(k, named, w);
        ++report.rejected;
    }
}

// Returns how far the markers stand off the face, in the variances of what was measured.
double remember(const ShapeModel& model, const NamedMarkers& named, const TrackerWorkspace& w,
                TrackerState& state, TrackerReport& report) {
    double sum = 0.0;
    double off_sum = 0.0;
    double dimensions = 0.0;
    report.seen = 0;
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        const NamedMarker& marker = named.markers[k];
        if (!marker.seen) {
            state.missed[k] = static_cast<std::uint16_t>(std::min<int>(state.missed[k] + 1, 60000));
            state.velocity_mm[k] = Vec3::Zero();
            continue;
        }
        const Vec3 step = marker.position_mm - state.position_mm[k];
        state.velocity_mm[k] = state.missed[k] == 0 ? step : Vec3{Vec3::Zero()};
        state.position_mm[k] = marker.position_mm;
        state.missed[k] = 0;
        const Vec3 off = marker.position_mm - w.fit.headset_mm[k];
        sum += (off - state.bias_mm[k]).squaredNorm();
        // What was learnt of a wrong name would hide it here.
        const Vec3 weighted = marker.information * off;
        off_sum += off.dot(weighted);
        dimensions += marker.views == 1 ? 2.0 : 3.0;
        state.bias_mm[k] += kBiasLearning * (off - state.bias_mm[k]);
        ++report.seen;
    }
    state.fit = w.next;
    report.residual_mm = report.seen == 0 ? 0.0 : std::sqrt(sum / report.seen);
    return dimensions > 0.0 ? off_sum / dimensions : 0.0;
}

// Fallen and slid markers; what a slid one says counts less from here on.
void watch(const ShapeModel& model, const TrackerConfig& config, const SightingSet& sightings,
           NamedMarkers& named, TrackerState& state, TrackerWorkspace& w, TrackerReport& report) {
    MarkerWatchConfig watched = config.watch;
    watched.rate_hz = config.rate_hz;
    watch_markers(model, state.topology, watched,
                  {predicted(model, w), sightings, w.left_over, named, state.fit}, config.neutral_offset_mm,
                  {state.bias_mm.data(), model.marker_count}, state.watch);
    report.trouble = state.watch.trouble;
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        if (state.watch.trouble[k] == MarkerTrouble::kFallen) ++report.fallen;
        if (state.watch.trouble[k] != MarkerTrouble::kSlid) continue;
        ++report.slid;
        report.off_mm[k] = static_cast<float>(
            off_its_place_mm(state.fit.pose, config.neutral_offset_mm, state.bias_mm[k], k));
        named.markers[k].information *= kSlidTrust;
    }
}

void count_changes(const ShapeModel& model, const SightingSet& sightings, const Matches& before,
                   const Matches& after, TrackerReport& report) {
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        bool changed = false;
        for (std::size_t view = 0; view < sightings.view_count; ++view) {
            changed =
                changed || (before[view][k] >= 0 && after[view][k] >= 0 && before[view][k] != after[view][k]);
        }
        report.swaps_repaired = static_cast<std::uint16_t>(report.swaps_repaired + (changed ? 1 : 0));
    }
}

void clear_matches(Matches& matches) {
    for (auto& view : matches) view.fill(-1);
}

// Starts from the fit of a bootstrap: nothing is remembered yet, so the face alone predicts.
void begin_tracking(const ShapeModel& model, const ShapeFit& fit, TrackerState& state) {
    const BootstrapState starts = state.bootstrap;
    state = TrackerState{};
    state.bootstrap = starts;
    state.fit = fit;
    state.tracking = true;
    build_topology(model, state.topology);
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        state.missed[k] = 1;
        state.position_mm[k] = fit.headset_position(model, k);
    }
}

// Names from motion, the face from the names, and names again from the face, which does not know who was who.
void name_sightings(const ShapeModel& model, const TrackerConfig& config, const SightingSet& sightings,
                    std::span<const Vec3> before_mm, TrackerState& state, TrackerWorkspace& w,
                    NamedMarkers& named) {
    predict_motion(model, config, state, w);
    std::span<const Vec3> velocity = row_velocity(model, config, sightings, state, nullptr, {}, w);
    match_views(predicted(model, w), sightings, config.first_gate_mm, w.matching, w.matches, velocity);
    w.first_matches = w.matches;
    combine_views(predicted(model, w), sightings, config.gap_limit_mm, w.matches, named, velocity);
    fit_face(model, config, state, named, w);

    predict_face(model, state, w);
    velocity = row_velocity(model, config, sightings, state, &w.next, before_mm, w);
    match_views(predicted(model, w), sightings, config.final_gate_mm, w.matching, w.matches, velocity);
    combine_views(predicted(model, w), sightings, config.gap_limit_mm, w.matches, named, velocity);
    // With the same names the fit stands: what the views say across their rays does not depend on what was
    // predicted. With a rolling shutter the positions have moved with the new velocities, whatever the names.
    if (!velocity.empty() || !same_names(model.marker_count, sightings, w.matches, w.fitted_matches)) {
        fit_face(model, config, state, named, w);
    }
}

// Markers that are known to stand off their place: that the face does not explain where they are is no reason
// to take their sightings for others.
void mark_off_place(const ShapeModel& model, const TrackerConfig& config, const TrackerState& state,
                    TrackerWorkspace& w) {
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        w.off_place[k] =
            state.watch.trouble[k] == MarkerTrouble::kSlid ||
            off_its_place_mm(state.fit.pose, config.neutral_offset_mm, state.bias_mm[k], k) > kOffPlaceMm;
    }
}

// One opinion. When it is better the face starts from it, and markers that it names otherwise from nothing;
// the others keep what is known of them.
void hear_opinion(const ShapeModel& model, const TrackerConfig& config, const SightingSet& sightings,
                  TrackerState& state, TrackerWorkspace& w, NamedMarkers& named, TrackerReport& report) {
    const auto opinion = static_cast<std::uint8_t>(kOpinions - state.opinion.left--);
    NamingWorkspace& other = w.bootstrap.naming;
    mark_off_place(model, config, state, w);
    if (!second_opinion(model, w.next, sightings, w.matches, {w.off_place.data(), model.marker_count},
                        opinion, other))
        return;
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        bool changed = false;
        for (std::size_t view = 0; view < sightings.view_count; ++view)
            changed = changed || other.matches[view][k] != w.matches[view][k];
        // The face of before was bent to wrong names; where a marker with another name was, only the other
        // face tells, as the helmet sat then.
        w.before_mm[k] = changed || state.missed[k] > 0
                             ? state.fit.pose.apply(model.face_position(k, other.trial.coefficients))
                             : Vec3{state.position_mm[k] - state.bias_mm[k]};
        if (!changed) continue;
        state.missed[k] = std::max<std::uint16_t>(state.missed[k], 1);
        state.velocity_mm[k] = Vec3::Zero();
        state.bias_mm[k] = Vec3::Zero();
        ++report.reconsidered;
    }
    report.swaps_repaired = static_cast<std::uint16_t>(report.swaps_repaired + report.reconsidered);
    take_opinion(state.opinion);
    state.fit = other.trial;
    name_sightings(model, config, sightings, {w.before_mm.data(), model.marker_count}, state, w, named);
}

// Of neighbours that have changed places one name at least is wrong: both wait until the face says which.
void reject_broken_order(const ShapeModel& model, const TrackerState& state, NamedMarkers& named,
                         TrackerWorkspace& w, TrackerReport& report) {
    report.order_broken = find_broken_order(state.topology, w.next.pose.rotation, named, w.broken);
    if (report.order_broken == 0) return;
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        if (!w.broken[k]) continue;
        withhold(k, named, w);
        ++report.rejected;
    }
}

double least_seen(const ShapeModel& model, const TrackerConfig& config) {
    return std::max(static_cast<double>(kMinMarkers), config.lost_share * model.marker_count);
}

// A frame in which hardly any marker is seen says nothing of the names.
bool shows_a_face(const ShapeModel& model, const TrackerConfig& config, const NamedMarkers& named) {
    std::size_t seen = 0;
    for (std::size_t k = 0; k < model.marker_count; ++k) seen += named.markers[k].seen ? 1U : 0U;
    return static_cast<double>(seen) >= least_seen(model, config);
}

void notice_loss(const ShapeModel& model, const TrackerConfig& config, TrackerState& state,
                 TrackerReport& report) {
    state.poor_frames = report.seen < least_seen(model, config)
                            ? static_cast<std::uint16_t>(state.poor_frames + 1)
                            : std::uint16_t{0};
    if (state.poor_frames >= config.lost_frames) reset_tracker(state);
    report.tracking = state.tracking;
}

void clear_named(const ShapeModel& model, NamedMarkers& named) {
    named.count = model.marker_count;
    for (std::size_t k = 0; k < model.marker_count; ++k) named.markers[k] = NamedMarker{};
}

}  // namespace

void reset_tracker(TrackerState& state) {
    state = TrackerState{};
}

std::span<const Vec3> predict_markers(const ShapeModel& model, const TrackerConfig& config,
                                      const TrackerState& state, TrackerWorkspace& w) {
    RIG_CHECK(state.tracking);
    predict_motion(model, config, state, w);
    return predicted(model, w);
}

void track(const ShapeModel& model, const TrackerConfig& config, const SightingSet& sightings,
           TrackerState& state, TrackerWorkspace& w, NamedMarkers& named, TrackerReport& report) {
    report = TrackerReport{};
    clear_matches(w.matches);
    clear_named(model, named);
    if (!state.tracking) {
        ShapeFit found;
        const BootstrapReport start = bootstrap(model, config.bootstrap, config.nominal, sightings,
                                                state.bootstrap, w.bootstrap, found);
        if (!start.found) {
            report.matches = w.matches;
            return;
        }
        begin_tracking(model, found, state);
        ask_for_opinions(state.opinion);
        report.bootstrapped = true;
    }
    name_sightings(model, config, sightings, {}, state, w, named);
    if (state.opinion.left > 0 && !report.bootstrapped && shows_a_face(model, config, named)) {
        hear_opinion(model, config, sightings, state, w, named, report);
    }
    reject_outliers(model, config, state, named, w, report);
    if (!report.bootstrapped) hold_returns(model, config, state, named, w);
    reject_broken_order(model, state, named, w, report);
    count_changes(model, sightings, w.first_matches, w.matches, report);
    predict_face(model, state, w);
    const double ratio = remember(model, named, w, state, report);
    find_left_over(model.marker_count, sightings, w.matches, w.left_over);
    const bool odd = report.rejected > 0 || ratio > config.suspicious_ratio;
    if (report.seen >= least_seen(model, config))
        suspect(model, predicted(model, w), sightings, w.matches, w.left_over, odd, state.opinion);
    watch(model, config, sightings, named, state, w, report);
    state.capture_us = sightings.capture_us;
    report.matches = w.matches;
    notice_loss(model, config, state, report);
}

void check_names(const ShapeModel& model, const TrackerConfig& config, std::span<const Vec3> labelled_mm,
                 double sigma_mm, TrackerState& state, TrackerWorkspace& w, SightingSet& scratch,
                 NamedMarkers& named, TrackerReport& report) {
    RIG_CHECK(labelled_mm.size() == model.marker_count);
    report = TrackerReport{};
    clear_matches(w.matches);
    clear_named(model, named);
    scratch.clear();
    add_point_view(labelled_mm, sigma_mm, scratch);
    for (std::size_t i = 0; i < scratch.views[0].size(); ++i) {
        w.matches[0][scratch.source[0][i]] = static_cast<std::int16_t>(i);
    }
    w.first_matches = w.matches;
    if (!state.tracking) {
        ShapeFit start;
        start.pose = config.nominal;
        begin_tracking(model, start, state);
        report.bootstrapped = true;
        // Nothing is known before the first frame: let the claimed names place the face.
        state.fit.coefficients.fill(0.0);
    }
    TrackerConfig wide = config;
    if (report.bootstrapped) {
        wide.pose_sigma_rad = config.bootstrap.rotation_sigma_rad;
        wide.pose_sigma_mm = config.bootstrap.translation_sigma_mm;
        wide.expression_sigma = 1.5;
    }
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        w.predicted_mm[k] = state.fit.headset_position(model, k) + state.bias_mm[k];
    }
    combine_views(predicted(model, w), scratch, config.gap_limit_mm, w.matches, named);
    fit_face(model, wide, state, named, w);
    bool contradicted = false;
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        contradicted =
            contradicted || (named.markers[k].seen && residual_of(w, state, named, k) > config.outlier_mm);
    }
    if (contradicted) {
        predict_face(model, state, w);
        match_views(predicted(model, w), scratch, config.final_gate_mm, w.matching, w.matches);
        combine_views(predicted(model, w), scratch, config.gap_limit_mm, w.matches, named);
        fit_face(model, wide, state, named, w);
        reject_outliers(model, config, state, named, w, report);
        count_changes(model, scratch, w.first_matches, w.matches, report);
    }
    reject_broken_order(model, state, named, w, report);
    predict_face(model, state, w);
    remember(model, named, w, state, report);
    find_left_over(model.marker_count, scratch, w.matches, w.left_over);
    watch(model, config, scratch, named, state, w, report);
    report.matches = w.matches;
    notice_loss(model, config, state, report);
}

}  // namespace rig
