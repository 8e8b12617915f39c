// One Euro filter, one per shape [Casiez, Roussel, Vogel: 1 Euro filter, CHI 2012, algorithm 1]: a
// first-order low-pass whose cut-off rises with speed, so that a resting face is calm and a fast one is not
// late. Causal.
//
//   speed  += a(derivative_cutoff) ((x - y) / dt - speed)
//   y      += a(min_cutoff + beta |speed|) (x - y),          a(f) = 1 / (1 + 1 / (2 pi f dt))
//
// Not for: loss of input (recovery_blend.hpp) or knowledge about the face (the solver's temporal prior).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/limits.hpp"

namespace rig {

// The defaults were chosen on a range-of-motion take at 60 Hz behind the box QP with its temporal prior, 0.1
// mm marker noise: steps from frame to frame 0.0134 -> 0.0089 rms, weight error 0.0160 -> 0.0153, marker
// error 0.038 -> 0.048 mm. Slower ones (6, 4, 2) rest a little more calmly (0.0079) and trail moving markers
// by 0.09 mm.
struct OneEuroConfig {
    double rate_hz = 60.0;              // nominal, 1..1000
    double min_cutoff_hz = 4.0;         // > 0: jitter at rest against lag at the start of a movement
    double beta = 20.0;                 // >= 0, Hz per (weight / s)
    double derivative_cutoff_hz = 4.0;  // > 0
    std::span<const float> low;         // [N] ranges of the weights
    std::span<const float> high;        // [N]
};

struct OneEuroState {
    bool started = false;
    std::int64_t previous_us = 0;
    std::array<double, kMaxShapes> value{};
    std::array<double, kMaxShapes> speed_per_s{};
};

struct OneEuroReport {
    bool interval_clamped = false;     // dt outside [0.25, 4] frames: clamped, speeds start anew (F34)
    std::uint16_t inputs_refused = 0;  // not finite: the last value stands in
};

// weights and filtered: [N], may be the same memory. filtered is always finite and in [low, high]. The first
// call (and the first after reset_one_euro) hands its input on.
void filter_one_euro(const OneEuroConfig& config, std::span<const double> weights, std::int64_t capture_us,
                     OneEuroState& state, std::span<double> filtered, OneEuroReport& report);

void reset_one_euro(OneEuroState& state);

}  // namespace rig
