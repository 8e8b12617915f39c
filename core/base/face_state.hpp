// The result of a frame, as it is streamed and recorded. Plain numbers, shared by pipeline and wire.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/faults.hpp"
#include "core/limits.hpp"

namespace rig {

// The state ladder of the output contract. Worse states have smaller numbers, so "the worst wins" is
// std::min.
enum class TrackingState : std::uint8_t { kSafe = 0, kLost = 1, kHold = 2, kPartial = 3, kLive = 4 };

enum class CameraStatus : std::uint8_t {
    kUnused = 0,   // not part of this rig
    kGood = 1,     // delivered the frame of this tick
    kMissing = 2,  // nothing usable for this tick
    kGone = 3,     // unplugged or closed
    kFrozen = 4,   // repeats itself
    kExposure = 5  // too dark, too bright, or changing at once
};

// Whether a camera's picture of this tick is looked at.
[[nodiscard]] constexpr bool has_picture(CameraStatus status) {
    return status == CameraStatus::kGood || status == CameraStatus::kExposure;
}

// Headset slip: observed = R(rotation) face + translation. Rotation vector, rig origin.
struct Slip {
    std::array<float, 3> rotation_rad{};
    std::array<float, 3> translation_mm{};
};

// Why a tick says nothing of where the head is. The order is the wire's.
enum class HeadStatus : std::uint8_t {
    kUnknown = 0,    // the cameras are on the head, or no face was solved in this tick
    kKnown = 1,      // measured
    kTooFew = 2,     // too few markers
    kFlat = 3,       // the markers that are seen lie nearly in a plane
    kBehind = 4,     // no place before the cameras explains them
    kUncertain = 5,  // some motion is left open
    kMistaken = 6    // too many markers disagree
};

// Where the head is before cameras that are not on it: reference = R(rotation) face + translation, in the
// frame of the cameras' places. Of this tick's own pictures, neither smoothed nor held. All zero, the status
// aside, unless it is known.
struct HeadPlace {
    HeadStatus status = HeadStatus::kUnknown;
    std::int64_t capture_us = 0;    // mid-exposure of this tick's pictures
    std::uint16_t points_used = 0;  // markers that agree, each as often as cameras see it
    std::array<float, 3> rotation_rad{};
    std::array<float, 3> translation_mm{};
    std::array<float, 3> rotation_sigma_rad{};    // standard deviations; rotation about the markers' centroid
    std::array<float, 3> translation_sigma_mm{};  // of that centroid
    float rms_px = 0.0F;
};

// Every weight is finite and inside the range that its pack declares. When `held`, no solve stands behind
// this tick: weights are the last good ones, the decay to rest or the rest pose, and age_us says how old the
// capture is.
struct FaceState {
    std::uint32_t sequence = 0;   // +1 each tick, wraps
    std::int64_t capture_us = 0;  // mid-exposure of the frame behind the weights, board's monotonic clock
    std::int64_t age_us = 0;      // time of encoding minus capture_us
    TrackingState state = TrackingState::kSafe;
    bool held = true;
    std::array<CameraStatus, kMaxCameras> cameras{};
    FaultMap faults = 0;  // current, not latched
    Slip slip;
    HeadPlace head;
    std::uint16_t shape_count = 0;
    std::array<float, kMaxShapes> weights{};
    std::array<float, kMaxShapes> confidence{};  // 0..1
};

}  // namespace rig
