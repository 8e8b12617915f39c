// The one frame format of every link: 0x00 COBS(version, type, flags, source, sequence, length, payload,
// CRC-32C) 0x00. PROTOCOL.md of this folder is normative. Not for: what payloads mean (the *_messages.hpp
// headers).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/bytes.hpp"
#include "core/base/result.hpp"
#include "core/limits.hpp"
#include "core/wire/wire_error.hpp"

namespace rig {

inline constexpr std::uint8_t kWireProtocol = 1;  // of PROTOCOL.md; independent of releases

inline constexpr std::size_t kFrameHeadBytes = 10;  // version..payload length
inline constexpr std::size_t kFrameCrcBytes = 4;
inline constexpr std::size_t kFrameDelimiterBytes = 2;
inline constexpr std::size_t kMaxCobsBytes = kMaxWireFrameBytes - kFrameDelimiterBytes;

// COBS adds one byte, and one more for every 254 bytes.
[[nodiscard]] constexpr std::size_t cobs_bound(std::size_t raw_bytes) {
    return raw_bytes + raw_bytes / 254 + 1;
}

inline constexpr std::size_t kMaxWirePayloadBytes = 636;
inline constexpr std::size_t kMaxRawFrameBytes = kFrameHeadBytes + kMaxWirePayloadBytes + kFrameCrcBytes;
static_assert(cobs_bound(kMaxRawFrameBytes) == kMaxCobsBytes, "the largest payload fills the largest frame");

enum class MessageType : std::uint8_t {
    kHelloRequest = 0x01,
    kHello = 0x02,
    kNamesRequest = 0x03,
    kNames = 0x04,
    kTimeRequest = 0x05,
    kTimeReply = 0x06,
    kGoodbye = 0x07,
    kWeights = 0x10,
    kMarkers = 0x11,
    kStatus = 0x12,
    kEvent = 0x13,
    kHeadPose = 0x14,
    kStartStreams = 0x20,
    kStopStreams = 0x21,
    kStatusRequest = 0x22,
    kCommand = 0x23,
    kControl = 0x24,
    kAck = 0x30,
    kNak = 0x31,
};

inline constexpr std::uint8_t kSourceHost = 0;
inline constexpr std::uint8_t kSourceBoard = 1;

struct FrameHead {
    MessageType type =
        MessageType::kHello;  // any value may arrive; unknown ones are the receiver's to refuse
    std::uint8_t flags = 0;   // protocol 1 defines none: sent as 0, ignored when received
    std::uint8_t source = kSourceHost;
    std::uint32_t sequence = 0;  // +1 for each frame that this source hands to this link, wraps
};

struct FrameView {
    FrameHead head;
    ByteSpan payload;  // borrowed from the decoder until its next call
};

// Writes a whole frame, delimiters included, to the front of `into` and returns its length, at most
// kMaxWireFrameBytes. kSpace: `into` is too small (kMaxWireFrameBytes always suffices). kLength: payload over
// kMaxWirePayloadBytes.
[[nodiscard]] Result<std::size_t, WireError> encode_frame(const FrameHead& head, ByteSpan payload,
                                                          MutableByteSpan into);

// What came through a decoder. Every delimited run of bytes is counted exactly once; empty runs (the two
// delimiters between frames) and the run before the first delimiter are not.
struct FrameCounters {
    std::uint64_t good = 0;
    std::uint64_t bad_crc = 0;
    std::uint64_t bad_cobs = 0;  // a code byte points beyond the run
    std::uint64_t too_long = 0;  // run over kMaxCobsBytes; skipped to the next delimiter
    std::uint64_t bad_length =
        0;  // shorter than an empty frame, or the length field disagrees under a good CRC
    std::uint64_t bad_version = 0;  // whole and checked, but another protocol's

    [[nodiscard]] std::uint64_t bad() const {
        return bad_crc + bad_cobs + too_long + bad_length + bad_version;
    }
};

// Finds frames in a stream of bytes. Contract: any bytes in any chunking; work per byte is bounded; no
// allocation. Every delimiter starts anew, so damage outside a frame's own bytes never loses that frame.
class FrameDecoder {
  public:
    // Consumes bytes from the front of `chunk` until a frame is whole (true: `frame` is set) or the chunk is
    // used up (false). Call until it returns false.
    [[nodiscard]] bool next(ByteSpan& chunk, FrameView& frame);
    // Forgets a partial frame, as after a reconnect; keeps the counters.
    void reset();
    [[nodiscard]] const FrameCounters& counters() const { return counters_; }

  private:
    [[nodiscard]] bool finish_run(FrameView& frame);

    std::array<std::byte, kMaxCobsBytes> run_{};
    std::size_t size_ = 0;
    bool skipping_ = true;  // until the next delimiter
    FrameCounters counters_;
};

}  // namespace rig
