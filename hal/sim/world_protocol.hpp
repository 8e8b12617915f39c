// The boundary between a simulated world and the daemon: a Unix stream socket for messages and one shared
// memory file for images. Any program that speaks it can stand in for the world; WORLD.md tells it in words.
//
// The world listens. The daemon connects, and receives one WorldHello whose ancillary data carries the file
// descriptor of the shared memory. From then on each side sends fixed-size WorldMessage records,
// little-endian. Image of camera c in ring slot s: at image_offset + (s * camera_count + c) *
// image_stride_bytes, 8-bit grey, rows of width_px bytes without gaps. The world does not write a slot
// between its kFrameSet and the daemon's kSlotFree.
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

#include "core/limits.hpp"

namespace rig::sim {

inline constexpr std::uint32_t kWorldMagic = 0x31574752;  // "RGW1"
inline constexpr std::uint16_t kWorldVersion = 1;

enum class WorldPace : std::uint8_t {
    kLockstep = 0,  // simulated clock: the daemon's clock is the time of the last message; the world sends
                    // the next kFrameSet only after kTickDone (it may render ahead, never send ahead)
    kRealTime =
        1,  // times are CLOCK_MONOTONIC; the world sends when a frame is due and drops when no slot is free
};

struct WorldHello {
    std::uint32_t magic = kWorldMagic;
    std::uint16_t version = kWorldVersion;
    WorldPace pace = WorldPace::kLockstep;
    std::uint8_t camera_count = 0;
    std::uint16_t width_px = 0;
    std::uint16_t height_px = 0;
    std::uint32_t rate_millihertz = 0;
    std::uint32_t slot_count = 0;
    std::uint32_t image_stride_bytes = 0;
    std::uint64_t image_offset = 0;
    std::uint64_t memory_bytes = 0;
    std::uint64_t frame_total = 0;  // 0: endless
};

enum class WorldMessageKind : std::uint8_t {
    // world -> daemon
    kFrameSet =
        1,  // slot, camera_mask, sequence, time_us = mid-exposure; published_us = CLOCK_MONOTONIC when sent
    kLineEdge = 2,  // line, active, time_us
    kAdvance = 3,   // lockstep only: time goes on to time_us without a frame
    kEnd = 4,       // no more frames
    // daemon -> world
    kSlotFree = 16,  // slot
    kTickDone = 17,  // sequence: lockstep's leave to go on
    kSetLine = 18,   // line, active
    kExposure = 19,  // camera, value (microseconds)
    kGain = 20,      // camera, value (decibel)
};

// Lines by number; a board file gives them names.
enum class WorldLine : std::uint8_t {
    kTrigger = 0,
    kButtonNeutral = 1,
    kButtonRecord = 2,
    kButtonPresence = 3,
    kLed = 4,
    kStrobe = 5
};
inline constexpr std::size_t kWorldLineCount = 6;

struct WorldMessage {
    WorldMessageKind kind = WorldMessageKind::kEnd;
    std::uint8_t camera_or_line = 0;
    std::uint8_t camera_mask = 0;  // bit c: camera c delivered an image of this set
    std::uint8_t active = 0;
    std::uint32_t slot = 0;
    std::uint32_t sequence = 0;
    float value = 0.0F;
    std::int64_t time_us = 0;
    std::int64_t published_us = 0;
};

static_assert(sizeof(WorldHello) == 48 && std::is_trivially_copyable_v<WorldHello>);
static_assert(sizeof(WorldMessage) == 32 && std::is_trivially_copyable_v<WorldMessage>);

}  // namespace rig::sim
