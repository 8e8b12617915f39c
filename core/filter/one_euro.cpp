#include "core/filter/one_euro.hpp"

#include "core/base/check.hpp"
#include "core/base/math.hpp"
#include "core/filter/frame_interval.hpp"

namespace rig {

namespace {

constexpr double kTwoPi = 6.28318530717958647692;

double smoothing(double cutoff_hz, double dt_s) {
    const double x = kTwoPi * cutoff_hz * dt_s;
    return x / (1.0 + x);  // 1 / (1 + 1 / x), without the division by a small x
}

double magnitude(double x) {
    return x < 0.0 ? -x : x;
}

}  // namespace

void filter_one_euro(const OneEuroConfig& config, std::span<const double> weights, std::int64_t capture_us,
                     OneEuroState& state, std::span<double> filtered, OneEuroReport& report) {
    const std::size_t n = config.low.size();
    RIG_CHECK(config.high.size() == n && weights.size() == n && filtered.size() == n && n <= kMaxShapes);
    report = OneEuroReport{};
    const FrameInterval interval = frame_interval(state.previous_us, capture_us, config.rate_hz);
    report.interval_clamped = state.started && !interval.believable;
    const double speed_share = smoothing(config.derivative_cutoff_hz, interval.seconds);
    for (std::size_t i = 0; i < n; ++i) {
        const auto low = static_cast<double>(config.low[i]);
        const auto high = static_cast<double>(config.high[i]);
        double target = weights[i];
        if (!is_finite(target)) {
            ++report.inputs_refused;
            target = state.value[i];  // before the start: 0, which the clamp below brings into range
        }
        target = target < low ? low : (target > high ? high : target);
        double& value = state.value[i];
        double& speed = state.speed_per_s[i];
        if (!state.started) {
            value = target;
            speed = 0.0;
        } else {
            if (report.interval_clamped) {
                speed = 0.0;
            } else {
                speed += speed_share * ((target - value) / interval.seconds - speed);
            }
            value += smoothing(config.min_cutoff_hz + config.beta * magnitude(speed), interval.seconds) *
                     (target - value);
        }
        value = value < low ? low : (value > high ? high : value);
        filtered[i] = value;
    }
    state.started = true;
    state.previous_us = capture_us;
}

void reset_one_euro(OneEuroState& state) {
    state = OneEuroState{};
}

}  // namespace rig
