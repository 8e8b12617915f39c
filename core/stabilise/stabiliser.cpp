#include "core/stabilise/stabiliser.hpp"

#include <cmath>

#include "core/base/math.hpp"

namespace rig {

namespace {

// mm and rad: a pose that must not move. Its square beside a mode's prior of 1 has to stay within the 14
// digits that the Cholesky factor asks for, or the fit is refused and nothing is inferred.
constexpr double kHeldSigma = 1e-6;
constexpr double kStepSigmas = 1e-2;  // of the last step; what is left is a tenth of it

std::size_t fill_input(const NamedMarkers& named, StabiliserWorkspace& w) {
    std::size_t seen = 0;
    for (std::size_t k = 0; k < named.count; ++k) {
        const NamedMarker& marker = named.markers[k];
        w.positions_mm[k] = marker.position_mm;
        w.informations[k] = marker.seen ? marker.information : Mat3{Mat3::Zero()};
        seen += marker.seen ? 1U : 0U;
    }
    return seen;
}

void to_face_frame(const NamedMarkers& named, const Rigid& pose, StabiliserOutput& output) {
    output.count = named.count;
    output.headset_from_face = pose;
    for (std::size_t k = 0; k < named.count; ++k) {
        const NamedMarker& marker = named.markers[k];
        StabilisedMarker& out = output.markers[k];
        out = StabilisedMarker{};
        if (!marker.seen) continue;
        out.seen = true;
        out.position_mm = pose.apply_inverse(marker.position_mm);
        const Mat3 turned = marker.information * pose.rotation;
        out.information = pose.rotation.transpose() * turned;
    }
}

ShapeFit nominal_fit(const StabiliserConfig& config) {
    ShapeFit fit;
    fit.pose = config.nominal;
    return fit;
}

ShapePrior wide_prior(const StabiliserConfig& config) {
    ShapePrior prior;
    prior.pose = config.nominal;
    prior.rotation_sigma_rad = config.enabled ? config.rotation_sigma_rad : kHeldSigma;
    prior.translation_sigma_mm = config.enabled ? config.translation_sigma_mm : kHeldSigma;
    return prior;
}

bool moved_too_far(const StabiliserConfig& config, const Rigid& from, const Rigid& to) {
    const Vec3 shift = to.translation_mm - from.translation_mm;
    const Mat3 turned = to.rotation * from.rotation.transpose();
    const Vec3 turn = vector_from_rotation(turned);
    return std::sqrt(shift.dot(shift)) > config.jolt_sigmas * config.step_translation_sigma_mm ||
           std::sqrt(turn.dot(turn)) > config.jolt_sigmas * config.step_rotation_sigma_rad;
}

// `fit` is the start on entry and the answer on return.
void fit_pose(const ShapeModel& model, const StabiliserConfig& config, std::size_t count,
              StabiliserState& state, StabiliserWorkspace& w, ShapeFit& fit, StabiliserReport& report) {
    const std::span<const Vec3> positions(w.positions_mm.data(), count);
    const std::span<const Mat3> informations(w.informations.data(), count);
    const ShapeFit start = fit;
    if (state.warm && config.enabled) {
        ShapePrior creeping;
        creeping.pose = state.fit.pose;
        creeping.rotation_sigma_rad = config.step_rotation_sigma_rad;
        creeping.translation_sigma_mm = config.step_translation_sigma_mm;
        fit_shape(model, positions, informations, creeping, {config.steps, kStepSigmas}, start, state.memory, w.fit,
                  fit);
        report.ok = fit.ok;
        report.jolt = !fit.ok || moved_too_far(config, start.pose, fit.pose);
        if (!report.jolt) return;
    }
    const int steps = state.warm ? config.steps : config.first_steps;
    fit_shape(model, positions, informations, wide_prior(config), {steps, kStepSigmas}, start, state.memory,
              w.fit, fit);
    report.ok = fit.ok;
}

}  // namespace

void reset_stabiliser(StabiliserState& state) {
    state = StabiliserState{};
}

void stabilise(const ShapeModel& model, const StabiliserConfig& config, const NamedMarkers& named,
               StabiliserState& state, StabiliserWorkspace& w, StabiliserOutput& output,
               StabiliserReport& report) {
    report = StabiliserReport{};
    const std::size_t seen = fill_input(named, w);
    output.fit = state.warm && config.enabled ? state.fit : nominal_fit(config);
    if (seen >= kMinMarkers) fit_pose(model, config, named.count, state, w, output.fit, report);
    if (report.ok) {
        state.fit = output.fit;
        state.warm = true;
    }
    const Rigid pose = config.enabled ? output.fit.pose : config.nominal;
    to_face_frame(named, pose, output);
    const Vec3 turn = vector_from_rotation(pose.rotation);
    report.slip_rotation_rad = std::sqrt(turn.dot(turn));
    report.slip_translation_mm = std::sqrt(pose.translation_mm.dot(pose.translation_mm));
}

}  // namespace rig
