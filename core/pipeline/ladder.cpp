#include "core/pipeline/ladder.hpp"

#include <algorithm>

#include "core/base/elapsed.hpp"

namespace rig {

namespace {

std::uint16_t counted(std::uint16_t run, bool goes_on) {
    constexpr std::uint16_t kEnough = 60000;
    return goes_on ? static_cast<std::uint16_t>(std::min<int>(run + 1, kEnough)) : std::uint16_t{0};
}

void climb(const LadderConfig& config, const LadderInput& input, LadderState& s) {
    if (s.state == TrackingState::kLost) s.state = TrackingState::kHold;
    if (s.state == TrackingState::kHold) {
        if (s.usable_run >= config.good_frames) {
            s.state = s.whole_run >= config.good_frames ? TrackingState::kLive : TrackingState::kPartial;
        }
    } else if (input.partial) {
        s.state = TrackingState::kPartial;
    } else if (s.state == TrackingState::kPartial && s.whole_run >= config.good_frames) {
        s.state = TrackingState::kLive;
    }
}

void fall(const LadderConfig& config, const LadderInput& input, LadderState& s) {
    const auto three_frames_us = static_cast<std::int64_t>(3e6 / config.rate_hz);
    if (input.now_us < s.last_usable_us)
        s.last_usable_us = input.now_us;  // the clock went back: count from there
    const std::int64_t silent_us = elapsed_us(s.last_usable_us, input.now_us);
    if (silent_us < std::max(config.hold_after_us, three_frames_us)) return;
    if (s.state > TrackingState::kHold) s.state = TrackingState::kHold;
    if (silent_us >= config.lost_after_us) s.state = TrackingState::kLost;
}

}  // namespace

void step_ladder(const LadderConfig& config, const LadderInput& input, LadderState& s) {
    if (!input.configured) {
        s = LadderState{};
        return;
    }
    if (s.state == TrackingState::kSafe) {
        s.state = TrackingState::kHold;
        s.last_usable_us = input.now_us;
    }
    s.usable_run = counted(s.usable_run, input.usable);
    s.whole_run = counted(s.whole_run, input.usable && !input.partial);
    if (!input.usable) {
        fall(config, input, s);
        return;
    }
    s.last_usable_us = input.now_us;
    s.ever_usable = true;
    climb(config, input, s);
}

}  // namespace rig
