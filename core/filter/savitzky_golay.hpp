// Causal Savitzky-Golay filter of order 2 [Savitzky, Golay: Smoothing and differentiation of data by
// simplified least squares procedures, Analytical Chemistry 36, 1964; Hybrid16 section 7.2], one window for
// each shape, one delay for all:
//
//   y(n) = p(t_(n-d)),   p = argmin over quadratics of sum_(k = n-w+1..n) (p(t_k) - x_k)^2,   d = delay < w
//
// in the true capture times, not in frame numbers: a dropped frame or a jittering clock leaves a quadratic in
// time exact. An interval outside 0.25..4 nominal frames (frame_interval.hpp) is a hole, and the filter
// starts anew behind it: one quadratic across a hole would join two movements that have nothing to do with
// each other.
//
// Warm-up: with k < w frames in hand the fit goes through these k (a constant for one, a line for two), and
// the answer is for frame max(first, n - d). So the first answer is the first input, the time of what is
// answered never runs back, and the delay grows from 0 to d.
//
// A fit overshoots; what leaves the range is put at its end. Not for: quick response at rest and in motion
// alike (one_euro.hpp).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/limits.hpp"

namespace rig {

struct SavitzkyGolayConfig {
    double rate_hz = 60.0;           // nominal, 1..1000
    std::uint16_t delay_frames = 0;  // d, 0..kMaxWindowFrames - 1
    // [N] w, 1..kMaxWindowFrames, above the delay. 1 stands for a shape that is not smoothed, only delayed
    // with the others, whatever the delay; 2 gives the samples back too, for a line goes through both.
    std::span<const std::uint8_t> window_frames;
    std::span<const float> low;   // [N] ranges of the weights
    std::span<const float> high;  // [N]
};

// The rules of the comments above, and as many windows as ranges.
[[nodiscard]] bool is_valid(const SavitzkyGolayConfig& config);

// 126 kB: the last kMaxWindowFrames frames.
struct SavitzkyGolayState {
    std::uint16_t count = 0;   // frames in hand
    std::uint16_t newest = 0;  // slot of the last frame
    std::array<std::int64_t, kMaxWindowFrames> time_us{};
    std::array<std::array<double, kMaxShapes>, kMaxWindowFrames> value{};
};

struct SavitzkyGolayReport {
    bool restarted = false;            // a hole in time: what came before is forgotten (F34)
    bool warm = false;                 // every shape has its whole window
    std::uint16_t inputs_refused = 0;  // not finite: the value of the frame before stands in
    std::uint16_t delay_frames = 0;    // of this answer: d, or less while the filter warms up
    std::int64_t answered_us = 0;      // capture time of the frame that was answered for
    std::int64_t delay_us = 0;         // capture_us - answered_us
};

// weights and filtered: [N], may be the same memory. filtered is always finite and in [low, high].
// Precondition: is_valid(config). Bounded work: kMaxWindowFrames N multiplications and, for each length of
// window in use, 10 w more.
void filter_savitzky_golay(const SavitzkyGolayConfig& config, std::span<const double> weights,
                           std::int64_t capture_us, SavitzkyGolayState& state, std::span<double> filtered,
                           SavitzkyGolayReport& report);

// Forgets the frames; their memory is not cleared.
void reset_savitzky_golay(SavitzkyGolayState& state);

// The numbers c with p(at) = sum c_k x_k for the quadratic p that fits x_k at u_k best; u rising, in any
// unit, at any place. One point: the constant; two: the line. By orthogonal polynomials on the points, so
// that no matrix is solved. coefficients.size() == u.size() >= 1.
void savitzky_golay_coefficients(std::span<const double> u, double at, std::span<double> coefficients);

}  // namespace rig
