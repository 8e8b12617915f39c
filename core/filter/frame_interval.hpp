// The time between two frames as filters may use it.
#pragma once

#include <cstdint>

namespace rig {

// F34 of the reliability catalogue: outside these many nominal frames an interval is not believed.
inline constexpr double kMinIntervalFrames = 0.25;
inline constexpr double kMaxIntervalFrames = 4.0;

struct FrameInterval {
    double seconds = 0.0;    // clamped
    bool believable = true;  // false: it was outside and has been clamped
};

// rate_hz > 0. Any times, also equal, falling or further apart than 64 bits hold.
[[nodiscard]] FrameInterval frame_interval(std::int64_t previous_us, std::int64_t now_us, double rate_hz);

}  // namespace rig
