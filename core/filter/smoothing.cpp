#include "core/filter/smoothing.hpp"

#include <algorithm>

#include "core/base/check.hpp"
#include "core/base/math.hpp"

namespace rig {

namespace {

constexpr std::uint8_t kSmallestWindow = 3;

SavitzkyGolayConfig windows_of(const SmoothingConfig& config) {
    const std::size_t n = config.low.size();
    return {config.one_euro.rate_hz,
            config.choice.delay_frames,
            {config.window_frames.data(), n},
            config.low,
            config.high};
}

}  // namespace

bool is_valid(const FilterChoice& choice, std::size_t shape_count) {
    if (shape_count > kMaxShapes || choice.delay_frames >= kMaxWindowFrames) return false;
    return std::all_of(
        choice.shapes.begin(), choice.shapes.begin() + static_cast<std::ptrdiff_t>(shape_count),
        [&](const ShapeFilter& shape) {
            if (shape.kind != FilterKind::kSavitzkyGolay) return shape.kind <= FilterKind::kOneEuro;
            return shape.window_frames >= kSmallestWindow && shape.window_frames <= kMaxWindowFrames &&
                   shape.window_frames > choice.delay_frames;
        });
}

FilterChoice same_filter(ShapeFilter filter, std::uint8_t delay_frames) {
    FilterChoice choice;
    choice.shapes.fill(filter);
    choice.delay_frames = delay_frames;
    return choice;
}

void configure_smoothing(const FilterChoice& choice, double rate_hz, std::span<const float> low,
                         std::span<const float> high, SmoothingConfig& config) {
    const std::size_t n = low.size();
    RIG_CHECK(high.size() == n && is_valid(choice, n));
    config = SmoothingConfig{};
    config.choice = choice;
    config.low = low;
    config.high = high;
    config.one_euro.rate_hz = rate_hz;
    config.one_euro.low = low;
    config.one_euro.high = high;
    config.any_one_euro = false;
    config.any_delay = choice.delay_frames > 0;
    for (std::size_t i = 0; i < n; ++i) {
        const ShapeFilter& shape = choice.shapes[i];
        const bool fits = shape.kind == FilterKind::kSavitzkyGolay;
        config.window_frames[i] = fits ? shape.window_frames : std::uint8_t{1};
        config.any_one_euro = config.any_one_euro || shape.kind == FilterKind::kOneEuro;
        config.any_delay = config.any_delay || fits;
    }
}

void smooth(const SmoothingConfig& config, std::span<const double> weights, std::int64_t capture_us,
            SmoothingState& state, std::span<double> filtered, SmoothingReport& report) {
    const std::size_t n = config.low.size();
    RIG_CHECK(weights.size() == n && filtered.size() == n);
    report = SmoothingReport{};
    report.answered_us = capture_us;
    const std::span<double> undelayed(state.undelayed.data(), n);
    if (config.any_one_euro) {
        OneEuroReport calm;
        filter_one_euro(config.one_euro, weights, capture_us, state.one_euro, undelayed, calm);
        report.interval_clamped = calm.interval_clamped;
        report.inputs_refused = calm.inputs_refused;
    }
    for (std::size_t i = 0; i < n; ++i) {
        if (config.choice.shapes[i].kind == FilterKind::kOneEuro) continue;
        if (is_finite(weights[i])) {
            undelayed[i] = std::clamp(weights[i], static_cast<double>(config.low[i]),
                                      static_cast<double>(config.high[i]));
        } else {
            // Before the first number: 0, or the end of the range next to it.
            undelayed[i] = std::clamp(undelayed[i], static_cast<double>(config.low[i]),
                                      static_cast<double>(config.high[i]));
            if (!config.any_one_euro) ++report.inputs_refused;
        }
    }
    if (!config.any_delay) {
        std::copy(undelayed.begin(), undelayed.end(), filtered.begin());
        return;
    }
    SavitzkyGolayReport fit;
    filter_savitzky_golay(windows_of(config), undelayed, capture_us, state.savitzky_golay, filtered, fit);
    report.interval_clamped = report.interval_clamped || fit.restarted;
    report.delay_frames = fit.delay_frames;
    report.delay_us = fit.delay_us;
    report.answered_us = fit.answered_us;
}

void reset_smoothing(SmoothingState& state) {
    reset_one_euro(state.one_euro);
    reset_savitzky_golay(state.savitzky_golay);
    state.undelayed.fill(0.0);
}

}  // namespace rig
