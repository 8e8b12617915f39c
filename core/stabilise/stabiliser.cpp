#include "core/stabilise/stabiliser.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/math.hpp"
#include "core/geometry/triangulation.hpp"

namespace rig {

namespace {

// mm and rad: a pose that must not move. Its square beside a mode's prior of 1 has to stay within the 14
// digits that the Cholesky factor asks for, or the fit is refused and nothing is inferred.
constexpr double kHeldSigma = 1e-6;
constexpr double kStepSigmas = 1e-2;   // of the last step; what is left is a tenth of it
constexpr int kDoubtRounds = 4;        // three of sixty markers off by centimetres take two or three
constexpr double kSuspectShare = 0.5;  // of outlier_mm: nearer to the common fit nobody is looked into
constexpr double kNearShare = 0.25;    // ... nor below this share of the farthest
// Of a marker's influence on its own place that is taken out: the matrix behind it is good to a tenth.
constexpr double kOwnShare = 0.9;
constexpr double kTrustStep = 0.02;  // a smaller change of a doubted marker's trust moves nothing

std::size_t fill_input(const NamedMarkers& named, StabiliserWorkspace& w) {
    std::size_t seen = 0;
    for (std::size_t k = 0; k < named.count; ++k) {
        const NamedMarker& marker = named.markers[k];
        w.positions_mm[k] = marker.position_mm;
        w.informations[k] = marker.seen ? marker.information : Mat3{Mat3::Zero()};
        w.trust[k] = 1.0;
        seen += marker.seen ? 1U : 0U;
    }
    return seen;
}

void to_face_frame(const NamedMarkers& named, const Rigid& pose, const StabiliserWorkspace& w,
                   StabiliserOutput& output) {
    output.count = named.count;
    output.headset_from_face = pose;
    for (std::size_t k = 0; k < named.count; ++k) {
        const NamedMarker& marker = named.markers[k];
        StabilisedMarker& out = output.markers[k];
        out = StabilisedMarker{};
        if (!marker.seen) continue;
        out.seen = true;
        out.position_mm = pose.apply_inverse(marker.position_mm);
        const Mat3 turned = w.informations[k] * pose.rotation;
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

// How far a marker stands off the face that the other markers make. A marker drags its own place along, some
// by three quarters: its distance from the common fit would hide it and accuse its neighbours.
double distance_from_others_mm(const ShapeModel& model, const NamedMarker& marker, std::size_t k,
                               const Mat3& rotation, const ShapeFitMemory& memory, StabiliserWorkspace& w) {
    const Vec3 e = marker.position_mm - w.fit.headset_mm[k];
    const Mat3 turned = rotation * fitted_covariance(model, k, memory, w.fit);
    const Mat3 known = turned * rotation.transpose();
    const Mat3 system = Mat3::Identity() - kOwnShare * known * w.informations[k];
    const Vec3 alone = inverse_3x3(system) * e;
    return measured_length_mm(marker.information, alone);
}

// True when what some marker counts changed enough to move the fit. Of those still trusted only the worst and
// what stands off half as far are doubted in a round.
bool doubt_markers(const ShapeModel& model, const StabiliserConfig& config, const NamedMarkers& named,
                   const ShapeFit& fit, const ShapeFitMemory& memory, StabiliserWorkspace& w,
                   StabiliserReport& report) {
    double farthest_mm = 0.0;
    for (std::size_t k = 0; k < named.count; ++k) {
        const NamedMarker& marker = named.markers[k];
        w.distance_mm[k] =
            marker.seen ? measured_length_mm(marker.information, marker.position_mm - w.fit.headset_mm[k])
                        : 0.0;
        if (w.trust[k] == 1.0) farthest_mm = std::max(farthest_mm, w.distance_mm[k]);
    }
    const double suspect_mm = std::max(kSuspectShare * config.outlier_mm, kNearShare * farthest_mm);
    std::size_t suspects = 0;
    for (std::size_t k = 0; k < named.count; ++k) suspects += w.distance_mm[k] > suspect_mm ? 1U : 0U;
    // When most stand off alike it is the pose that is wrong, not the markers.
    if (2 * suspects > named.count) return false;
    double worst_mm = 0.0;
    for (std::size_t k = 0; k < named.count; ++k) {
        if (w.trust[k] < 1.0 || w.distance_mm[k] <= suspect_mm) continue;
        w.distance_mm[k] = distance_from_others_mm(model, named.markers[k], k, fit.pose.rotation, memory, w);
        worst_mm = std::max(worst_mm, w.distance_mm[k]);
    }
    const double new_limit_mm = std::max(config.outlier_mm, 0.5 * worst_mm);
    bool changed = false;
    report.doubted = 0;
    for (std::size_t k = 0; k < named.count; ++k) {
        if (!named.markers[k].seen) continue;
        const double limit_mm = w.trust[k] == 1.0 ? new_limit_mm : config.outlier_mm;
        const double ratio = w.distance_mm[k] > limit_mm ? config.outlier_mm / w.distance_mm[k] : 1.0;
        const double trust = ratio * ratio * ratio * ratio;
        report.doubted = static_cast<std::uint16_t>(report.doubted + (trust < 0.5 ? 1 : 0));
        if (trust == w.trust[k] || (trust < 1.0 && std::abs(trust - w.trust[k]) <= kTrustStep)) continue;
        w.trust[k] = trust;
        w.informations[k] = trust * named.markers[k].information;
        changed = true;
    }
    return changed;
}

// Fits, doubts what stands off, fits again; `fit` is the start on entry and the answer on return.
void fit_robustly(const ShapeModel& model, const StabiliserConfig& config, const NamedMarkers& named,
                  const ShapePrior& prior, int steps, ShapeFitMemory& memory, StabiliserWorkspace& w,
                  ShapeFit& fit, StabiliserReport& report) {
    const std::span<const Vec3> positions(w.positions_mm.data(), named.count);
    const std::span<const Mat3> informations(w.informations.data(), named.count);
    for (int round = 0; round <= kDoubtRounds; ++round) {
        const ShapeFit start = fit;
        fit_shape(model, positions, informations, prior, {steps, kStepSigmas}, start, memory, w.fit, fit);
        if (!fit.ok || round == kDoubtRounds ||
            !doubt_markers(model, config, named, fit, memory, w, report)) {
            return;
        }
    }
}

void fit_pose(const ShapeModel& model, const StabiliserConfig& config, const NamedMarkers& named,
              StabiliserState& state, StabiliserWorkspace& w, ShapeFit& fit, StabiliserReport& report) {
    const ShapeFit start = fit;
    if (state.warm && config.enabled) {
        ShapePrior creeping;
        creeping.pose = state.fit.pose;
        creeping.rotation_sigma_rad = config.step_rotation_sigma_rad;
        creeping.translation_sigma_mm = config.step_translation_sigma_mm;
        fit_robustly(model, config, named, creeping, config.steps, state.memory, w, fit, report);
        report.ok = fit.ok;
        report.jolt = !fit.ok || moved_too_far(config, start.pose, fit.pose);
        if (!report.jolt) return;
    }
    // After a jolt the pose was held where it is not: what was doubted there may be right.
    fill_input(named, w);
    const int steps = state.warm ? config.steps : config.first_steps;
    fit = start;
    fit_robustly(model, config, named, wide_prior(config), steps, state.memory, w, fit, report);
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
    if (seen >= kMinMarkers) fit_pose(model, config, named, state, w, output.fit, report);
    if (report.ok) {
        state.fit = output.fit;
        state.warm = true;
    }
    const Rigid pose = config.enabled ? output.fit.pose : config.nominal;
    to_face_frame(named, pose, w, output);
    const Vec3 turn = vector_from_rotation(pose.rotation);
    report.slip_rotation_rad = std::sqrt(turn.dot(turn));
    report.slip_translation_mm = std::sqrt(pose.translation_mm.dot(pose.translation_mm));
}

}  // namespace rig
