// How weights come back after a loss without a pop (clause C8 of the reliability contract): nothing moves
// until N good frames in a row, then the gap between what was held and what is solved fades away, no faster
// than a slew limit.
//
//   output = solved + fade(u) gap,   gap = held - solved when the blend starts,   fade(u) = 1 - u^2 (3 - 2
//   u), u = 0..1
//
// so |output_t - output_(t-1)| <= |solved_t - solved_(t-1)| + max_slew_per_s dt, and the blend ends after a
// known time. Not for: what is held meanwhile; hold or decay is the loss policy's choice and comes in as
// `held`.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/limits.hpp"

namespace rig {

struct RecoveryConfig {
    double rate_hz = 60.0;          // nominal, 1..1000
    std::uint16_t good_frames = 5;  // N: LIVE takes 5 good frames
    double max_slew_per_s = 5.0;    // > 0, of the fading gap; a whole range of 1 takes 0.3 s
    std::span<const float> low;     // [N] ranges of the weights
    std::span<const float> high;    // [N]
};

enum class RecoveryPhase : std::uint8_t { kHeld = 0, kBlending = 1, kLive = 2 };

struct RecoveryState {
    RecoveryPhase phase = RecoveryPhase::kHeld;
    std::uint16_t good_in_a_row = 0;
    std::int64_t previous_us = 0;
    bool timed = false;       // previous_us holds a time
    double elapsed_s = 0.0;   // since the blend began
    double duration_s = 0.0;  // of the blend
    std::array<double, kMaxShapes> gap{};
};

struct RecoveryReport {
    RecoveryPhase phase = RecoveryPhase::kHeld;
    double remaining = 0.0;  // share of the gap still in the output: 1 held .. 0 live
};

// One tick. good: `solved` is a usable solve. held: [N] what is sent while nothing is solved, in particular
// what was sent last. output: [N], always finite and in range; may be the memory of `solved` or `held`. A bad
// tick at any time goes back to kHeld, from what is then sent.
void blend_recovery(const RecoveryConfig& config, bool good, std::span<const double> solved,
                    std::span<const double> held, std::int64_t now_us, RecoveryState& state,
                    std::span<double> output, RecoveryReport& report);

void reset_recovery(RecoveryState& state);

}  // namespace rig
