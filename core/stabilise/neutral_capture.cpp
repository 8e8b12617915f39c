#include "core/stabilise/neutral_capture.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"
#include "core/geometry/triangulation.hpp"

namespace rig {

namespace {

// Of all that is known of a marker, what a direction needs to be learnt along: the rays of one camera turn by
// some milliradians with the face, which is no knowledge of depth.
constexpr double kLeastShare = 1e-3;

void add_frame(const ShapeModel& model, std::span<const float> neutral_mm, const StabiliserOutput& stabilised,
               NeutralState& state) {
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        const StabilisedMarker& marker = stabilised.markers[k];
        if (!marker.seen) continue;
        const Vec3 off = marker.position_mm - point_at(neutral_mm, k);
        ++state.seen[k];
        state.sum_mm[k] += off;
        state.squares_mm2[k] += off.dot(off);
        state.information[k] += marker.information;
        const Vec3 weighted = marker.information * off;
        state.weighted[k] += weighted;
    }
    for (std::size_t j = 0; j < model.mode_count; ++j)
        state.coefficients[j] += stabilised.fit.coefficients[j];
    ++state.frames;
}

bool seen_enough(const NeutralState& state, std::size_t k) {
    return state.seen[k] > 0 && 2U * state.seen[k] >= state.frames;
}

// Weighted mean of the displacements. Where one camera leaves the depth open, nothing is learnt along it.
Vec3 mean_offset(const NeutralState& state, std::size_t k) {
    const Mat3& information = state.information[k];
    const double trust = information.trace();
    if (!(trust > 0.0)) return Vec3::Zero();
    const Mat3 held = information + kLeastShare * trust * Mat3::Identity();
    return inverse_3x3(held) * state.weighted[k];
}

struct Worst {
    double value = 0.0;
    std::uint16_t marker = 0;
    void look(double x, std::size_t k) {
        if (x <= value) return;
        value = x;
        marker = static_cast<std::uint16_t>(k);
    }
};

bool refuse(NeutralRefusal refusal, const Worst& worst, NeutralReport& report) {
    report.phase = NeutralPhase::kRefused;
    report.refusal = refusal;
    report.value = worst.value;
    report.marker = worst.marker;
    return false;
}

double share_seen(const ShapeModel& model, const NeutralState& state) {
    double count = 0.0;
    for (std::size_t k = 0; k < model.marker_count; ++k) count += seen_enough(state, k) ? 1.0 : 0.0;
    return count / static_cast<double>(model.marker_count);
}

Worst largest_movement(const ShapeModel& model, const NeutralState& state) {
    Worst worst;
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        if (!seen_enough(state, k)) continue;
        const double n = state.seen[k];
        const Vec3 mean = state.sum_mm[k] / n;
        worst.look(std::sqrt(std::max(0.0, state.squares_mm2[k] / n - mean.dot(mean))), k);
    }
    return worst;
}

// How far the fitted face, by its expression alone, is from the neutral one.
double expression_rms(const ShapeModel& model, std::span<const float> neutral_mm, const NeutralState& state) {
    std::array<double, kMaxModes> mean{};
    for (std::size_t j = 0; j < model.mode_count; ++j) mean[j] = state.coefficients[j] / state.frames;
    double sum = 0.0;
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        const Vec3 off = model.face_position(k, mean) - point_at(neutral_mm, k);
        sum += off.dot(off);
    }
    return std::sqrt(sum / static_cast<double>(model.marker_count));
}

// All rules, in the order in which a person would mend them. False when one is broken.
bool at_rest(const ShapeModel& model, std::span<const float> neutral_mm, double noise_mm,
             const NeutralConfig& config, const NeutralState& state, NeutralReport& report) {
    const double share = share_seen(model, state);
    if (share < config.seen_share) return refuse(NeutralRefusal::kUnseen, {share, 0}, report);
    const Worst movement = largest_movement(model, state);
    const double still2 = config.still_mm * config.still_mm + 3.0 * noise_mm * noise_mm;
    if (movement.value * movement.value > still2) return refuse(NeutralRefusal::kMoved, movement, report);
    const double expression = expression_rms(model, neutral_mm, state);
    if (expression > config.expression_mm)
        return refuse(NeutralRefusal::kExpression, {expression, 0}, report);
    return true;
}

void finish(const ShapeModel& model, const NeutralConfig& config, NeutralState& state,
            NeutralReport& report) {
    std::array<Vec3, kMaxMarkers> offset = state.offset_mm;
    Worst largest;
    double sum = 0.0;
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        if (seen_enough(state, k)) offset[k] += mean_offset(state, k);
        const double squared = offset[k].dot(offset[k]);
        sum += squared;
        largest.look(std::sqrt(squared), k);
    }
    if (!(largest.value <= config.most_offset_mm) || !std::isfinite(sum)) {
        refuse(NeutralRefusal::kOffset, largest, report);
        return;
    }
    state.offset_mm = offset;
    state.any = true;
    report.phase = NeutralPhase::kTaken;
    report.value = largest.value;
    report.marker = largest.marker;
    report.rms_mm = std::sqrt(sum / static_cast<double>(model.marker_count));
}

}  // namespace

void begin_neutral(NeutralState& state) {
    const std::array<Vec3, kMaxMarkers> offset = state.offset_mm;
    const bool any = state.any;
    state = NeutralState{};
    state.offset_mm = offset;
    state.any = any;
    state.collecting = true;
}

void reset_neutral(NeutralState& state) {
    state = NeutralState{};
}

void subtract_offsets(const NeutralState& state, const Rigid& pose, NamedMarkers& named) {
    if (!state.any) return;
    for (std::size_t k = 0; k < named.count; ++k) {
        if (!named.markers[k].seen) continue;
        const Vec3 turned = pose.rotation * state.offset_mm[k];
        named.markers[k].position_mm -= turned;
    }
}

void watch_neutral(const ShapeModel& model, std::span<const float> neutral_mm, double noise_mm,
                   const NeutralConfig& config, const StabiliserOutput* stabilised, NeutralState& state,
                   NeutralReport& report) {
    RIG_CHECK(neutral_mm.size() == 3U * model.marker_count);
    report = NeutralReport{};
    if (!state.collecting) return;
    report.phase = NeutralPhase::kCollecting;
    ++state.ticks;
    if (stabilised != nullptr) add_frame(model, neutral_mm, *stabilised, state);
    report.frames = state.frames;
    if (state.frames >= config.frames) {
        if (at_rest(model, neutral_mm, noise_mm, config, state, report)) finish(model, config, state, report);
        state.collecting = false;
    } else if (state.ticks >= config.most_ticks) {
        const double share = static_cast<double>(state.frames) / static_cast<double>(config.frames);
        refuse(NeutralRefusal::kUnseen, {share, 0}, report);
        state.collecting = false;
    }
}

}  // namespace rig
