#include "core/filter/frame_interval.hpp"

namespace rig {

FrameInterval frame_interval(std::int64_t previous_us, std::int64_t now_us, double rate_hz) {
    // Unsigned, because a subtraction of wild times may overflow; what wraps around is far outside anyway.
    const std::uint64_t forward_us =
        static_cast<std::uint64_t>(now_us) - static_cast<std::uint64_t>(previous_us);
    const double frames = now_us > previous_us ? static_cast<double>(forward_us) * 1e-6 * rate_hz : 0.0;
    if (frames < kMinIntervalFrames) return {kMinIntervalFrames / rate_hz, false};
    if (frames > kMaxIntervalFrames) return {kMaxIntervalFrames / rate_hz, false};
    return {frames / rate_hz, true};
}

}  // namespace rig
