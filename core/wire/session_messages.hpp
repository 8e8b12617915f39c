// What host and board say to each other besides streams: who they are, names, time, start and stop, answers.
// encode() writes a payload to the front of `into` and returns its length (kSpace, kRange, kText); decode_*()
// is strict: the length must be exact, reserved bytes zero, every field in range. Layouts: PROTOCOL.md.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "core/base/bytes.hpp"
#include "core/base/result.hpp"
#include "core/limits.hpp"
#include "core/wire/frame.hpp"
#include "core/wire/text.hpp"
#include "core/wire/wire_error.hpp"

namespace rig {

// Every time on the wire is in microseconds and within +-kMaxWireTime_us, so that differences never overflow.
inline constexpr std::int64_t kMaxWireTime_us = std::int64_t{1} << 60;

enum class Role : std::uint8_t { kHost = 0, kBoard = 1 };

// Bits of Hello::capabilities.
inline constexpr std::uint32_t kCanStreamMarkers = 1U << 0;
inline constexpr std::uint32_t kCanResetTracking = 1U << 1;
inline constexpr std::uint32_t kIsSimulated = 1U << 2;
inline constexpr std::uint32_t kCanControl = 1U << 3;
inline constexpr std::uint32_t kCanStreamHead = 1U << 4;  // its cameras are not on the head

// Both directions. A host leaves everything about a pack zero.
struct Hello {
    std::uint8_t protocol_min = kWireProtocol;
    std::uint8_t protocol_max = kWireProtocol;  // >= protocol_min
    Role role = Role::kHost;
    bool pack_loaded = false;
    bool pack_unsigned = false;
    std::uint32_t session_id = 0;  // drawn anew at each start of the program; a change means it restarted
    std::uint32_t capabilities = 0;
    std::uint16_t shape_count = 0;            // 0..kMaxShapes
    std::uint16_t marker_count = 0;           // 0..kMaxMarkers
    std::uint32_t rate_mhz = 0;               // ticks per 1000 s
    std::array<std::uint8_t, 8> pack_hash{};  // first bytes of the pack's own hash
    FixedText<24> firmware;                   // version
    FixedText<32> serial;                     // or name, of this board or host
    FixedText<24> board;                      // kind of board, e.g. "sim"
    bool operator==(const Hello&) const = default;
};
inline constexpr std::size_t kHelloBytes = 108;
[[nodiscard]] Result<std::size_t, WireError> encode(const Hello& hello, MutableByteSpan into);
// kVersion: well-formed, but its range of protocols does not include ours.
[[nodiscard]] Result<Hello, WireError> decode_hello(ByteSpan payload);

enum class NameKind : std::uint8_t { kShapes = 0, kMarkers = 1 };

struct NamesRequest {
    NameKind kind = NameKind::kShapes;
    std::uint16_t first = 0;  // index of the first name wanted
    bool operator==(const NamesRequest&) const = default;
};
[[nodiscard]] Result<std::size_t, WireError> encode(const NamesRequest& request, MutableByteSpan into);
[[nodiscard]] Result<NamesRequest, WireError> decode_names_request(ByteSpan payload);

// Names [first, first + count) of `total`.
struct NamesPage {
    NameKind kind = NameKind::kShapes;
    std::uint16_t total = 0;
    std::uint16_t first = 0;
    std::uint16_t count = 0;
    std::array<std::string_view, kMaxShapes>
        names{};  // borrowed from the payload; 1..kMaxNameBytes bytes each
};
// As many names of `all` from `first` as one payload holds. kRange: first > all.size(), or more names than
// kMaxShapes (kMaxMarkers for markers). kText: a name is empty, too long or not printable.
[[nodiscard]] Result<std::size_t, WireError> encode_names(NameKind kind,
                                                          std::span<const std::string_view> all,
                                                          std::uint16_t first, MutableByteSpan into);
[[nodiscard]] Result<NamesPage, WireError> decode_names(ByteSpan payload);

struct TimeRequest {
    std::int64_t host_sent_us = 0;  // host's monotonic clock
    bool operator==(const TimeRequest&) const = default;
};
struct TimeReply {
    std::int64_t host_sent_us = 0;       // as asked
    std::int64_t board_received_us = 0;  // board's monotonic clock
    std::int64_t board_sent_us = 0;      // >= board_received_us
    bool operator==(const TimeReply&) const = default;
};
[[nodiscard]] Result<std::size_t, WireError> encode(const TimeRequest& request, MutableByteSpan into);
[[nodiscard]] Result<TimeRequest, WireError> decode_time_request(ByteSpan payload);
[[nodiscard]] Result<std::size_t, WireError> encode(const TimeReply& reply, MutableByteSpan into);
[[nodiscard]] Result<TimeReply, WireError> decode_time_reply(ByteSpan payload);

inline constexpr std::uint8_t kStreamWeights = 1U << 0;
inline constexpr std::uint8_t kStreamMarkers = 1U << 1;
inline constexpr std::uint8_t kStreamStatus = 1U << 2;
inline constexpr std::uint8_t kAllStreams = kStreamWeights | kStreamMarkers | kStreamStatus;
// Head pose, sent before the weights of the same tick and only with them. Not among kAllStreams: boards
// without kCanStreamHead refuse a mask that has it.
inline constexpr std::uint8_t kStreamHead = 1U << 3;

// Starts the streams of `mask`; the others stay as they are. Divider d: every d-th tick is sent.
struct StartStreams {
    std::uint8_t mask = kStreamWeights;  // not 0
    std::uint16_t weights_divider = 1;   // each >= 1
    std::uint16_t markers_divider = 1;
    std::uint16_t status_divider = 60;
    bool operator==(const StartStreams&) const = default;
};
struct StopStreams {
    std::uint8_t mask = kAllStreams;  // not 0
    bool operator==(const StopStreams&) const = default;
};
[[nodiscard]] Result<std::size_t, WireError> encode(const StartStreams& start, MutableByteSpan into);
[[nodiscard]] Result<StartStreams, WireError> decode_start_streams(ByteSpan payload);
[[nodiscard]] Result<std::size_t, WireError> encode(const StopStreams& stop, MutableByteSpan into);
[[nodiscard]] Result<StopStreams, WireError> decode_stop_streams(ByteSpan payload);

enum class BoardCommand : std::uint8_t {
    kResetTracking = 1,  // forget identities and slip, as the board's button does
    kNeutral = 2,        // take the present face for the neutral one
    kForgetNeutral = 3,  // go back to the pack's own
};
struct CommandMessage {
    BoardCommand command = BoardCommand::kResetTracking;
    bool operator==(const CommandMessage&) const = default;
};
[[nodiscard]] Result<std::size_t, WireError> encode(const CommandMessage& command, MutableByteSpan into);
[[nodiscard]] Result<CommandMessage, WireError> decode_command(ByteSpan payload);

enum class EventKind : std::uint8_t { kFaultRaised = 0, kFaultCleared = 1, kLog = 2 };
enum class EventLevel : std::uint8_t { kInfo = 0, kWarning = 1, kError = 2 };
inline constexpr std::uint8_t kNoCamera = 0xFF;

struct EventMessage {
    std::int64_t time_us = 0;  // board's monotonic clock
    EventKind kind = EventKind::kLog;
    EventLevel level = EventLevel::kInfo;
    std::uint8_t fault = 0;           // 1..64 of the fault map; 0 for a log line
    std::uint8_t camera = kNoCamera;  // 0..kMaxCameras-1, or kNoCamera
    std::uint32_t count = 0;          // how often this fault has been raised since the start
    FixedText<120> text;
    bool operator==(const EventMessage&) const = default;
};
[[nodiscard]] Result<std::size_t, WireError> encode(const EventMessage& event, MutableByteSpan into);
[[nodiscard]] Result<EventMessage, WireError> decode_event(ByteSpan payload);

enum class NakReason : std::uint8_t {
    kUnknownType = 1,
    kBadLength = 2,
    kBadValue = 3,
    kVersion = 4,
    kBusy = 5,    // another host owns the session
    kDenied = 6,  // not allowed over this link, or not by this host
    kNotNow = 7,  // cannot be done in the present state
};
[[nodiscard]] NakReason nak_reason(WireError error);

// Answers one message of the other side, named by the type and sequence of its frame.
struct NakMessage {
    NakReason reason = NakReason::kUnknownType;
    std::uint8_t type = 0;
    std::uint32_t sequence = 0;
    bool operator==(const NakMessage&) const = default;
};
struct AckMessage {
    std::uint8_t type = 0;
    std::uint32_t sequence = 0;
    bool operator==(const AckMessage&) const = default;
};
[[nodiscard]] Result<std::size_t, WireError> encode(const NakMessage& nak, MutableByteSpan into);
[[nodiscard]] Result<NakMessage, WireError> decode_nak(ByteSpan payload);
[[nodiscard]] Result<std::size_t, WireError> encode(const AckMessage& ack, MutableByteSpan into);
[[nodiscard]] Result<AckMessage, WireError> decode_ack(ByteSpan payload);

enum class GoodbyeReason : std::uint8_t { kDone = 0, kShutdown = 1, kReplaced = 2, kFailed = 3 };
struct GoodbyeMessage {
    GoodbyeReason reason = GoodbyeReason::kDone;
    bool operator==(const GoodbyeMessage&) const = default;
};
[[nodiscard]] Result<std::size_t, WireError> encode(const GoodbyeMessage& goodbye, MutableByteSpan into);
[[nodiscard]] Result<GoodbyeMessage, WireError> decode_goodbye(ByteSpan payload);

// kHelloRequest and kStatusRequest carry no payload: kLength unless it is empty.
[[nodiscard]] Result<void, WireError> decode_empty(ByteSpan payload);

}  // namespace rig
