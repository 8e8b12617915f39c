#include "core/filter/savitzky_golay.hpp"

#include <algorithm>

#include "core/base/check.hpp"
#include "core/base/math.hpp"
#include "core/filter/frame_interval.hpp"

namespace rig {

namespace {

constexpr std::size_t kSmallestFit = 3;  // points that leave something to smooth

// Slot of the frame `age` frames before the newest.
std::size_t slot_of(const SavitzkyGolayState& state, std::size_t age) {
    return (state.newest + kMaxWindowFrames - age) % kMaxWindowFrames;
}

double in_range(const SavitzkyGolayConfig& config, std::size_t i, double value) {
    return std::clamp(value, static_cast<double>(config.low[i]), static_cast<double>(config.high[i]));
}

void take_frame(const SavitzkyGolayConfig& config, std::span<const double> weights, std::int64_t capture_us,
                SavitzkyGolayState& state, SavitzkyGolayReport& report) {
    const std::array<double, kMaxShapes>& before = state.value[state.newest];
    if (state.count > 0) {
        report.restarted =
            !frame_interval(state.time_us[state.newest], capture_us, config.rate_hz).believable;
    }
    const std::size_t slot = (state.newest + 1U) % kMaxWindowFrames;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        double value = weights[i];
        if (!is_finite(value)) {
            ++report.inputs_refused;
            value = state.count > 0 ? before[i] : 0.0;
        }
        state.value[slot][i] = in_range(config, i, value);
    }
    if (report.restarted) state.count = 0;
    state.time_us[slot] = capture_us;
    state.newest = static_cast<std::uint16_t>(slot);
    if (state.count < kMaxWindowFrames) ++state.count;
}

// Answers for all shapes of one window.
void fit_window(const SavitzkyGolayConfig& config, std::size_t window, std::size_t age,
                const SavitzkyGolayState& state, std::span<double> filtered) {
    const std::size_t points = std::min<std::size_t>(window, state.count);
    std::array<double, kMaxWindowFrames> u_frames{};
    std::array<double, kMaxWindowFrames> coefficients{};
    for (std::size_t k = 0; k < points; ++k) {
        const std::int64_t since_us =
            state.time_us[slot_of(state, points - 1 - k)] - state.time_us[state.newest];
        u_frames[k] = static_cast<double>(since_us) * 1e-6 * config.rate_hz;
    }
    savitzky_golay_coefficients({u_frames.data(), points}, u_frames[points - 1 - age],
                                {coefficients.data(), points});
    for (std::size_t i = 0; i < filtered.size(); ++i) {
        if (config.window_frames[i] != window) continue;
        double sum = 0.0;
        for (std::size_t k = 0; k < points; ++k) {
            sum += coefficients[k] * state.value[slot_of(state, points - 1 - k)][i];
        }
        filtered[i] = in_range(config, i, sum);
    }
}

}  // namespace

bool is_valid(const SavitzkyGolayConfig& config) {
    const std::size_t n = config.window_frames.size();
    if (n > kMaxShapes || config.low.size() != n || config.high.size() != n) return false;
    if (!(config.rate_hz >= 1.0 && config.rate_hz <= 1000.0)) return false;
    if (config.delay_frames >= kMaxWindowFrames) return false;
    return std::all_of(config.window_frames.begin(), config.window_frames.end(), [&](std::uint8_t window) {
        return window == 1 || (window > config.delay_frames && window <= kMaxWindowFrames);
    });
}

void savitzky_golay_coefficients(std::span<const double> u, double at, std::span<double> coefficients) {
    const std::size_t n = u.size();
    RIG_CHECK(n >= 1 && coefficients.size() == n);
    const auto count = static_cast<double>(n);
    double mean = 0.0;
    for (const double x : u) mean += x;
    mean /= count;
    double squares = 0.0;  // |p1|^2, p1 = u - mean
    double cubes = 0.0;
    for (const double x : u) {
        const double v = x - mean;
        squares += v * v;
        cubes += v * v * v;
    }
    const double alpha = n > 1 ? cubes / squares : 0.0;
    const double beta = squares / count;
    const auto second = [&](double v) { return v * v - alpha * v - beta; };  // p2
    double length = 0.0;                                                     // |p2|^2
    for (const double x : u) length += second(x - mean) * second(x - mean);
    const double slope = n > 1 ? (at - mean) / squares : 0.0;
    const double bend = n >= kSmallestFit ? second(at - mean) / length : 0.0;
    for (std::size_t k = 0; k < n; ++k) {
        coefficients[k] = 1.0 / count + slope * (u[k] - mean) + bend * second(u[k] - mean);
    }
}

void filter_savitzky_golay(const SavitzkyGolayConfig& config, std::span<const double> weights,
                           std::int64_t capture_us, SavitzkyGolayState& state, std::span<double> filtered,
                           SavitzkyGolayReport& report) {
    const std::size_t n = config.window_frames.size();
    RIG_CHECK(is_valid(config) && weights.size() == n && filtered.size() == n);
    report = SavitzkyGolayReport{};
    take_frame(config, weights, capture_us, state, report);

    const std::size_t age = std::min<std::size_t>(config.delay_frames, state.count - 1U);
    const std::size_t answered = slot_of(state, age);
    report.delay_frames = static_cast<std::uint16_t>(age);
    report.answered_us = state.time_us[answered];
    report.delay_us = capture_us - report.answered_us;
    report.warm = true;

    std::array<bool, kMaxWindowFrames + 1> used{};
    for (std::size_t i = 0; i < n; ++i) {
        const std::size_t window = config.window_frames[i];
        report.warm = report.warm && state.count >= std::max<std::size_t>(window, config.delay_frames + 1U);
        if (std::min<std::size_t>(window, state.count) < kSmallestFit) {
            filtered[i] = state.value[answered][i];
        } else {
            used[window] = true;
        }
    }
    for (std::size_t window = kSmallestFit; window <= kMaxWindowFrames; ++window) {
        if (used[window]) fit_window(config, window, age, state, filtered);
    }
}

void reset_savitzky_golay(SavitzkyGolayState& state) {
    state.count = 0;
    state.newest = 0;
}

}  // namespace rig
