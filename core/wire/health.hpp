// The board's wear and counters in one struct, as it is streamed. Counters run from the start of the program,
// wrap, and are never reset by a reconnect.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/bytes.hpp"
#include "core/base/face_state.hpp"
#include "core/base/result.hpp"
#include "core/limits.hpp"
#include "core/wire/wire_error.hpp"

namespace rig {

inline constexpr std::int16_t kTemperatureUnknown = -32768;

// Of a distribution since the start, microseconds.
struct TimeSpread {
    std::uint32_t p50_us = 0;
    std::uint32_t p99_us = 0;
    std::uint32_t max_us = 0;
    bool operator==(const TimeSpread&) const = default;
};

struct Health {
    std::int64_t now_us = 0;     // board's monotonic clock when this was encoded
    std::int64_t uptime_us = 0;  // since the program's start, >= 0
    // ticks
    std::uint32_t ticks = 0;
    std::uint32_t solved = 0;    // ticks with a solve behind them
    std::uint32_t held = 0;      // ticks without
    std::uint32_t overruns = 0;  // ticks that took longer than their period
    // link
    std::uint32_t frames_sent = 0;
    std::uint32_t frames_dropped = 0;  // replaced by a newer one before the link took them (latest wins)
    std::uint32_t rx_good = 0;
    std::uint32_t rx_bad = 0;
    // process
    std::uint32_t heap_calls_after_seal = 0;
    std::uint32_t peak_memory_kb = 0;
    std::int16_t temperature_dc = kTemperatureUnknown;  // tenths of a degree Celsius
    // cameras
    std::array<std::uint32_t, kMaxCameras> camera_good{};
    std::array<std::uint32_t, kMaxCameras> camera_missing{};
    std::array<std::uint16_t, kMaxCameras> observations{};  // in the last tick
    std::uint16_t markers_seen = 0;                         // in the last tick
    std::uint32_t swaps_repaired = 0;
    std::uint32_t bootstraps = 0;  // times that identities were found anew
    // times
    TimeSpread solve;    // images in hand to FaceState
    TimeSpread latency;  // mid-exposure to the frame handed to the link
    // faults
    TrackingState state = TrackingState::kSafe;
    FaultMap faults = 0;                           // now
    std::array<std::uint16_t, 64> fault_counts{};  // entry n-1: how often fault n was raised, saturating
    bool operator==(const Health&) const = default;
};

inline constexpr std::size_t kStatusBytes = 269;

// kSpace; kRange for a time or state out of range. decode also refuses any other length.
[[nodiscard]] Result<std::size_t, WireError> encode(const Health& health, MutableByteSpan into);
[[nodiscard]] Result<Health, WireError> decode_status(ByteSpan payload);

}  // namespace rig
