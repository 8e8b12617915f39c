#include "core/filter/recovery_blend.hpp"

#include "core/base/check.hpp"
#include "core/base/math.hpp"
#include "core/filter/frame_interval.hpp"

namespace rig {

namespace {

constexpr double kSteepestFade = 1.5;  // largest |d fade / du|, at u = 1/2

double fade(double u) {
    return u >= 1.0 ? 0.0 : 1.0 - u * u * (3.0 - 2.0 * u);
}

double in_range(const RecoveryConfig& config, std::size_t i, double value, double otherwise) {
    const auto low = static_cast<double>(config.low[i]);
    const auto high = static_cast<double>(config.high[i]);
    if (!is_finite(value)) value = is_finite(otherwise) ? otherwise : low;
    return value < low ? low : (value > high ? high : value);
}

void begin_blend(const RecoveryConfig& config, std::span<const double> solved, std::span<const double> held,
                 RecoveryState& state) {
    double widest = 0.0;
    for (std::size_t i = 0; i < solved.size(); ++i) {
        const double from = in_range(config, i, held[i], 0.0);
        state.gap[i] = from - in_range(config, i, solved[i], from);
        const double size = state.gap[i] < 0.0 ? -state.gap[i] : state.gap[i];
        if (size > widest) widest = size;
    }
    state.phase = RecoveryPhase::kBlending;
    state.elapsed_s = 0.0;
    state.duration_s = kSteepestFade * widest / config.max_slew_per_s;
}

void advance(const RecoveryConfig& config, bool good, std::span<const double> solved,
             std::span<const double> held, double dt_s, RecoveryState& state) {
    if (!good) {
        state.phase = RecoveryPhase::kHeld;
        state.good_in_a_row = 0;
        return;
    }
    if (state.good_in_a_row < config.good_frames) ++state.good_in_a_row;
    if (state.phase == RecoveryPhase::kHeld && state.good_in_a_row >= config.good_frames) {
        begin_blend(config, solved, held, state);
    } else if (state.phase == RecoveryPhase::kBlending) {
        state.elapsed_s += dt_s;
    }
    if (state.phase == RecoveryPhase::kBlending && state.elapsed_s >= state.duration_s)
        state.phase = RecoveryPhase::kLive;
}

}  // namespace

void blend_recovery(const RecoveryConfig& config, bool good, std::span<const double> solved,
                    std::span<const double> held, std::int64_t now_us, RecoveryState& state,
                    std::span<double> output, RecoveryReport& report) {
    const std::size_t n = config.low.size();
    RIG_CHECK(config.high.size() == n && solved.size() == n && held.size() == n && output.size() == n);
    RIG_CHECK(n <= kMaxShapes);
    const double dt_s = state.timed ? frame_interval(state.previous_us, now_us, config.rate_hz).seconds : 0.0;
    advance(config, good, solved, held, dt_s, state);
    state.previous_us = now_us;
    state.timed = true;

    const bool blending = state.phase == RecoveryPhase::kBlending;
    const double left = blending ? fade(state.elapsed_s / state.duration_s) : 0.0;
    report.phase = state.phase;
    report.remaining = state.phase == RecoveryPhase::kHeld ? 1.0 : left;
    for (std::size_t i = 0; i < n; ++i) {
        const double wanted = state.phase == RecoveryPhase::kHeld
                                  ? held[i]
                                  : solved[i] + (blending ? left * state.gap[i] : 0.0);
        output[i] = in_range(config, i, wanted, held[i]);
    }
}

void reset_recovery(RecoveryState& state) {
    state = RecoveryState{};
}

}  // namespace rig
