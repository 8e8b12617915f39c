// The streams: weights of a FaceState, where the head is, and measured markers, split over as many frames as
// they need, and the assembly of parts on the other side. Layouts: PROTOCOL.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/bytes.hpp"
#include "core/base/face_state.hpp"
#include "core/base/result.hpp"
#include "core/limits.hpp"
#include "core/track/named_markers.hpp"
#include "core/wire/frame.hpp"
#include "core/wire/wire_error.hpp"

namespace rig {

// A weight is a signed 16-bit count of 1/16384: -2 .. 1.99994, exact at 0, 1 and every binary fraction down
// to the step, and independent of any pack, so that a frame can be read without one.
inline constexpr double kWeightStep = 1.0 / 16384.0;
inline constexpr float kWireWeightLow = -2.0F;
inline constexpr float kWireWeightHigh = 32767.0F / 16384.0F;

inline constexpr std::size_t kWeightsHeadBytes = 62;
inline constexpr std::size_t kWeightBytes = 3;  // weight and confidence
inline constexpr std::size_t kWeightsPerPart =
    (kMaxWirePayloadBytes - kWeightsHeadBytes) / kWeightBytes;                                         // 191
inline constexpr std::size_t kMaxWeightsParts = (kMaxShapes + kWeightsPerPart - 1) / kWeightsPerPart;  // 2

// Part p of a state of `shape_count` shapes carries shapes [p * kWeightsPerPart, ...). At least one part, so
// that a board without a pack can say so.
[[nodiscard]] constexpr std::size_t weights_part_count(std::size_t shape_count) {
    return shape_count == 0 ? 1 : (shape_count + kWeightsPerPart - 1) / kWeightsPerPart;
}

struct WeightsPart {
    FaceState state;  // everything but the weights outside [first, first + count)
    bool altered =
        false;  // the encoder had to change a number of this state: not finite, or beyond the wire's range
    std::uint8_t part = 0;
    std::uint8_t part_count = 1;
    std::uint16_t first = 0;
    std::uint16_t count = 0;
};

// Payload of one part. Never refuses a state for its numbers: what is not finite is sent as 0 (confidence 0),
// what is beyond the wire's range at its end, both with the `altered` flag. kRange: shape_count > kMaxShapes,
// part beyond the last, or an enumerator outside its enum. kSpace: `into` is too small.
[[nodiscard]] Result<std::size_t, WireError> encode_weights(const FaceState& state, std::size_t part,
                                                            MutableByteSpan into);
[[nodiscard]] Result<WeightsPart, WireError> decode_weights(ByteSpan payload);

// Positions are counts of 0.01 mm in the headset frame: +-327.67 mm. One beyond that is sent as not seen.
inline constexpr std::size_t kMarkersHeadBytes = 20;
inline constexpr std::size_t kMarkerBytes = 7;
inline constexpr std::size_t kMarkersPerPart =
    (kMaxWirePayloadBytes - kMarkersHeadBytes) / kMarkerBytes;  // 88

[[nodiscard]] constexpr std::size_t markers_part_count(std::size_t marker_count) {
    return marker_count == 0 ? 1 : (marker_count + kMarkersPerPart - 1) / kMarkersPerPart;
}

struct MarkerSample {
    bool seen = false;
    std::uint8_t views = 0;              // cameras that saw it, 0..kMaxCameras; 0 for 3D input streams
    std::array<float, 3> position_mm{};  // headset frame; zero when not seen
    bool operator==(const MarkerSample&) const = default;
};

struct MarkerFrame {
    std::uint32_t sequence = 0;  // of the FaceState of the same tick
    std::int64_t capture_us = 0;
    std::uint16_t marker_count = 0;
    std::array<MarkerSample, kMaxMarkers> markers{};
};

struct MarkersPart {
    MarkerFrame frame;  // markers outside [first, first + count) are not set
    std::uint8_t part = 0;
    std::uint8_t part_count = 1;
    std::uint16_t first = 0;
    std::uint16_t count = 0;
};

[[nodiscard]] MarkerFrame marker_frame(const NamedMarkers& markers, std::uint32_t sequence);
[[nodiscard]] Result<std::size_t, WireError> encode_markers(const MarkerFrame& frame, std::size_t part,
                                                            MutableByteSpan into);
[[nodiscard]] Result<MarkersPart, WireError> decode_markers(ByteSpan payload);

// Where the head is, of a board whose cameras are not on it (kCanStreamHead).
inline constexpr std::size_t kHeadPoseBytes = 68;

struct HeadPoseMessage {
    std::uint32_t sequence = 0;  // of the FaceState of the same tick
    HeadPlace head;
};

// Never refuses a pose for its numbers: one with a number that is not finite, beyond +-1e6 or a negative
// deviation is sent as kUncertain. kRange: a status outside its enum. kSpace: `into` is too small.
[[nodiscard]] Result<std::size_t, WireError> encode(const HeadPoseMessage& message, MutableByteSpan into);
[[nodiscard]] Result<HeadPoseMessage, WireError> decode_head_pose(ByteSpan payload);

struct AssemblyCounters {
    std::uint64_t whole = 0;       // states handed out
    std::uint64_t abandoned = 0;   // states given up because a newer one began
    std::uint64_t lost_parts = 0;  // parts that those lacked
    std::uint64_t stale = 0;       // parts of an older state, or seen twice
};

// Which parts of which sequence have arrived; shared by the two assemblers below.
class PartLedger {
  public:
    enum class Verdict : std::uint8_t { kStale, kJoins, kStarts };

    // A step back of more than this many sequences is a restarted sender, not reordering.
    static constexpr std::int32_t kReorderWindow = 64;

    // `total`: elements of the whole state. Precondition: part < part_count <= 32.
    [[nodiscard]] Verdict accept(std::uint32_t sequence, std::uint16_t total, std::uint8_t part,
                                 std::uint8_t part_count);
    // True once for each whole state, right after the accept() that completed it.
    [[nodiscard]] bool complete();
    void reset();
    [[nodiscard]] const AssemblyCounters& counters() const { return counters_; }

  private:
    void abandon();

    std::uint32_t sequence_ = 0;
    std::uint32_t have_ = 0;  // bit per part
    std::uint16_t total_ = 0;
    std::uint8_t part_count_ = 0;
    bool any_ = false;
    bool done_ = false;
    AssemblyCounters counters_;
};

// Reunites the parts of states. Hands out each state once, whole, oldest first; a state that lacks a part
// when a newer one begins is abandoned and counted.
class StateAssembler {
  public:
    // True when `part` completed a state, which state() then holds until the next push().
    [[nodiscard]] bool push(const WeightsPart& part);
    [[nodiscard]] const FaceState& state() const { return state_; }
    [[nodiscard]] bool altered() const { return altered_; }
    // After a restart of the sender: the next part begins anew. Counters stay.
    void reset() { ledger_.reset(); }
    [[nodiscard]] const AssemblyCounters& counters() const { return ledger_.counters(); }

  private:
    FaceState state_;
    bool altered_ = false;
    PartLedger ledger_;
};

class MarkerAssembler {
  public:
    [[nodiscard]] bool push(const MarkersPart& part);
    [[nodiscard]] const MarkerFrame& frame() const { return frame_; }
    void reset() { ledger_.reset(); }
    [[nodiscard]] const AssemblyCounters& counters() const { return ledger_.counters(); }

  private:
    MarkerFrame frame_;
    PartLedger ledger_;
};

}  // namespace rig
