// What goes wrong, when and for how long: data that the faulty decorators of this folder carry out.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"

namespace rig::sim {

enum class FaultKind : std::uint8_t {
    kCameraGone,     // F01: kGone; start() fails until the event is over
    kCameraIo,       // F03: every transfer fails
    kCameraShort,    // F05: every frame has the wrong length
    kCameraSilent,   // F01: frames do not come, nothing is reported
    kCameraFrozen,   // F08: the picture of the event's first frame repeats under new sequence numbers
    kCameraLate,     // F10: frames arrive `magnitude` microseconds late
    kCameraReorder,  // F10: of two frames the newer is delivered first
    kExposureFlash,  // F13: `magnitude` (0..255) is added to every pixel
    kExposureDark,   // F13: every pixel is divided by `magnitude` (> 1)
    kLinkStall,      // F24: the other side does not read; nothing comes from it
    kLinkReset,      // F26: kClosed; open() fails until the event is over
    kLinkBitErrors,  // F21: each bit, both ways, flips with probability `magnitude`
    kLinkByteLoss,   // F22: each byte, both ways, is lost with probability `magnitude`
    kLinkPartial,    // F25: a write takes at most `magnitude` bytes
};

struct FaultEvent {
    std::int64_t at_us = 0;
    FaultKind what = FaultKind::kCameraGone;
    std::int64_t for_us = 0;
    std::uint8_t target = 0;  // camera or link number
    double magnitude = 0.0;
};

struct FaultPlan {
    std::vector<FaultEvent> events;
    std::uint64_t seed = 1;  // of everything random in carrying it out

    // The event in force at that time, or nullptr. The earliest listed wins.
    [[nodiscard]] const FaultEvent* active(FaultKind what, std::uint8_t target, std::int64_t now_us) const;
};

struct FaultPlanError {
    int line = 0;
    std::string reason;
};

// One event a line: `at_ms what for_ms target [magnitude]`, e.g. `2000 camera_gone 1500 0`; '#' starts a
// comment; `seed N` sets the seed. Names are the kinds above in snake_case without the k.
[[nodiscard]] Result<FaultPlan, FaultPlanError> parse_fault_plan(std::string_view text);

// SplitMix64 [Steele et al. 2014]: one 64-bit state, good enough for faults, the same everywhere.
class FaultRandom {
  public:
    explicit FaultRandom(std::uint64_t seed) : state_(seed) {}
    [[nodiscard]] std::uint64_t next() {
        std::uint64_t z = (state_ += 0x9E3779B97F4A7C15U);
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
        return z ^ (z >> 31);
    }
    [[nodiscard]] bool chance(double probability) {
        return static_cast<double>(next() >> 11) * 0x1.0p-53 < probability;
    }

  private:
    std::uint64_t state_;
};

}  // namespace rig::sim
