// The state ladder of the output contract: LIVE, PARTIAL, HOLD, LOST, SAFE, with hysteresis (clauses C7 and
// C8 of the reliability page). Decides only the state; what is put out in it is the pipeline's business.
#pragma once

#include <cstdint>

#include "core/base/face_state.hpp"

namespace rig {

struct LadderConfig {
    double rate_hz = 60.0;
    std::uint16_t good_frames = 5;        // in a row, to climb to LIVE or out of PARTIAL
    std::int64_t hold_after_us = 40'000;  // without a usable frame; or three frames, when that is longer
    std::int64_t lost_after_us = 300'000;
};

struct LadderState {
    TrackingState state = TrackingState::kSafe;
    std::uint16_t usable_run = 0;  // usable frames in a row
    std::uint16_t whole_run = 0;   // ... that were not partial
    bool ever_usable = false;
    std::int64_t last_usable_us = 0;
};

struct LadderInput {
    std::int64_t now_us = 0;
    bool configured = false;  // a valid pack is in place
    bool usable = false;      // this tick has a solve
    bool partial =
        false;  // a camera is absent, or a region is known less than half as well as when all is seen
};

void step_ladder(const LadderConfig& config, const LadderInput& input, LadderState& state);

}  // namespace rig
