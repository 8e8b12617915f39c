#include "core/stabilise/stabiliser.hpp"

#include <cmath>

#include "core/base/math.hpp"

namespace rig {

namespace {

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

}  // namespace

void reset_stabiliser(StabiliserState& state) {
    state = StabiliserState{};
}

void stabilise(const ShapeModel& model, const StabiliserConfig& config, const NamedMarkers& named,
               StabiliserState& state, StabiliserWorkspace& w, StabiliserOutput& output, StabiliserReport& report) {
    report = StabiliserReport{};
    const std::size_t seen = fill_input(named, w);
    ShapePrior prior;
    prior.pose = config.nominal;
    prior.rotation_sigma_rad = config.enabled ? config.rotation_sigma_rad : 1e-9;
    prior.translation_sigma_mm = config.enabled ? config.translation_sigma_mm : 1e-9;
    ShapeFit start;
    start.pose = config.nominal;
    if (state.warm && config.enabled) start = state.fit;
    if (seen >= kMinMarkers) {
        const int iterations = state.warm ? config.iterations : config.first_iterations;
        fit_shape(model, {w.positions_mm.data(), named.count}, {w.informations.data(), named.count}, prior, iterations,
                  start, w.fit, output.fit);
        report.ok = output.fit.ok;
    } else {
        output.fit = start;
    }
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
