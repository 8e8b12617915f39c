#include "tests/support/wire/messages.hpp"

#include <array>
#include <utility>

#include "core/wire/control_message.hpp"
#include "core/wire/health.hpp"
#include "core/wire/session_messages.hpp"
#include "core/wire/state_messages.hpp"

namespace rig::test {

namespace {

using Bytes = std::vector<std::byte>;
using Buffer = std::array<std::byte, kMaxWirePayloadBytes>;

Result<Bytes, WireError> as_bytes(const Buffer& buffer, const Result<std::size_t, WireError>& size) {
    if (!size) return failure(size.error());
    return Bytes(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(*size));
}

template <class Message>
Result<Bytes, WireError> again(const Result<Message, WireError>& message) {
    if (!message) return failure(message.error());
    Buffer buffer;
    return as_bytes(buffer, encode(*message, buffer));
}

Result<Bytes, WireError> names_again(ByteSpan payload) {
    const auto page = decode_names(payload);
    if (!page) return failure(page.error());
    // Names outside the page are unknown here; a span of the same size ends the new page where the old one
    // ended.
    std::vector<std::string_view> all(page->total, std::string_view("x"));
    for (std::size_t i = 0; i < page->count; ++i) all[page->first + i] = page->names[i];
    Buffer buffer;
    const auto room = MutableByteSpan(buffer).first(payload.size());
    return as_bytes(buffer, encode_names(page->kind, all, page->first, room));
}

Result<Bytes, WireError> weights_again(ByteSpan payload) {
    const auto part = decode_weights(payload);
    if (!part) return failure(part.error());
    Buffer buffer;
    auto bytes = as_bytes(buffer, encode_weights(part->state, part->part, buffer));
    // The flag tells of the sender's numbers, which the payload no longer holds.
    if (bytes && part->altered) (*bytes)[53] |= std::byte{2};
    return bytes;
}

Result<Bytes, WireError> markers_again(ByteSpan payload) {
    const auto part = decode_markers(payload);
    if (!part) return failure(part.error());
    Buffer buffer;
    return as_bytes(buffer, encode_markers(part->frame, part->part, buffer));
}

Result<Bytes, WireError> nothing_again(ByteSpan payload) {
    const auto empty = decode_empty(payload);
    if (!empty) return failure(empty.error());
    return Bytes{};
}

}  // namespace

Result<Bytes, WireError> reencoded(MessageType type, ByteSpan payload) {
    switch (type) {
        case MessageType::kHelloRequest:
        case MessageType::kStatusRequest:
            return nothing_again(payload);
        case MessageType::kHello:
            return again(decode_hello(payload));
        case MessageType::kNamesRequest:
            return again(decode_names_request(payload));
        case MessageType::kNames:
            return names_again(payload);
        case MessageType::kTimeRequest:
            return again(decode_time_request(payload));
        case MessageType::kTimeReply:
            return again(decode_time_reply(payload));
        case MessageType::kGoodbye:
            return again(decode_goodbye(payload));
        case MessageType::kWeights:
            return weights_again(payload);
        case MessageType::kMarkers:
            return markers_again(payload);
        case MessageType::kHeadPose:
            return again(decode_head_pose(payload));
        case MessageType::kStatus:
            return again(decode_status(payload));
        case MessageType::kEvent:
            return again(decode_event(payload));
        case MessageType::kStartStreams:
            return again(decode_start_streams(payload));
        case MessageType::kStopStreams:
            return again(decode_stop_streams(payload));
        case MessageType::kCommand:
            return again(decode_command(payload));
        case MessageType::kControl:
            return again(decode_control(payload));
        case MessageType::kAck:
            return again(decode_ack(payload));
        case MessageType::kNak:
            return again(decode_nak(payload));
    }
    return failure(WireError::kRange);
}

Bytes framed(const FrameHead& head, ByteSpan payload) {
    std::array<std::byte, kMaxWireFrameBytes> buffer;
    const auto size = encode_frame(head, payload, buffer);
    if (!size) return {};
    return Bytes(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(*size));
}

}  // namespace rig::test
