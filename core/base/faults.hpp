// Fault codes F01..F55 of the reliability catalogue, as numbers in code, logs and the stream.
#pragma once

#include <cstdint>

namespace rig {

// The value is the catalogue's number. In the 64-bit fault map, fault n is bit n - 1.
enum class Fault : std::uint8_t {
    kCameraGone = 1,
    kCameraIdentity = 2,
    kCameraIo = 3,
    kBufferError = 4,
    kShortFrame = 5,
    kCorruptJpeg = 6,
    kFormatChanged = 7,
    kCameraFrozen = 8,
    kSequenceGap = 9,
    kLateFrame = 10,
    kCounterWrap = 11,
    kCameraSync = 12,
    kExposure = 13,
    kBlobCapacity = 14,
    kMarkersMissing = 15,
    kMarkersLost = 16,
    kMarkerSwap = 17,
    kMarkerDrift = 18,
    kSolveWeak = 19,
    kRigMoved = 20,
    kLineNoise = 21,
    kLineOverrun = 22,
    kLineStart = 23,
    kHostStalled = 24,
    kPartialWrite = 25,
    kLinkReset = 26,
    kLinkSuspended = 27,
    kDatagramLoss = 28,
    kBadCommand = 29,
    kCommandFlood = 30,
    kProtocolVersion = 31,
    kBusy = 32,
    kWallClock = 33,
    kBadInterval = 34,
    kOverrun = 35,
    kThermal = 36,
    kHang = 37,
    kAllocation = 38,
    kRecordingStopped = 39,
    kRecordingCut = 40,
    kSettingsRefused = 41,
    kSettingsFallback = 42,
    kPackCorrupt = 43,
    kFlashCut = 44,
    kPackLength = 45,
    kPackHash = 46,
    kPackSignature = 47,
    kPackSemantics = 48,
    kPackIncompatible = 49,
    kDenied = 50,
    kDowngrade = 51,
    kTrialFailed = 52,
    kFlashAbandoned = 53,
    kFlashWear = 54,
    kNoSlot = 55,
};

using FaultMap = std::uint64_t;

[[nodiscard]] constexpr FaultMap fault_bit(Fault fault) {
    return FaultMap{1} << (static_cast<std::uint8_t>(fault) - 1);
}

}  // namespace rig
