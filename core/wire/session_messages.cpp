#include "core/wire/session_messages.hpp"

namespace rig {

namespace {

constexpr std::uint8_t kPackLoadedBit = 1U << 0;
constexpr std::uint8_t kPackUnsignedBit = 1U << 1;
constexpr std::uint8_t kHelloFlags = kPackLoadedBit | kPackUnsignedBit;

bool is_wire_time(std::int64_t time_us) {
    return time_us >= -kMaxWireTime_us && time_us <= kMaxWireTime_us;
}

// kSpace unless every field found room.
Result<std::size_t, WireError> finished(const ByteWriter& writer) {
    if (!writer.ok()) return failure(WireError::kSpace);
    return writer.size();
}

void write_zeros(ByteWriter& writer, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) writer.write(std::uint8_t{0});
}

bool read_zeros(ByteReader& reader, std::size_t count) {
    bool zero = true;
    for (std::size_t i = 0; i < count; ++i) zero = reader.read<std::uint8_t>() == 0 && zero;
    return zero;
}

template <std::size_t kBytes>
void write_text(ByteWriter& writer, const FixedText<kBytes>& text) {
    for (const char c : text.bytes) writer.write(c);
}

template <std::size_t kBytes>
FixedText<kBytes> read_text(ByteReader& reader) {
    FixedText<kBytes> text;
    for (char& c : text.bytes) c = reader.read<char>();
    return text;
}

// Printable up to the first zero byte, zeros behind it.
template <std::size_t kBytes>
bool is_good_text(const FixedText<kBytes>& text) {
    const std::string_view view = text.view();
    for (std::size_t i = view.size(); i < kBytes; ++i) {
        if (text.bytes[i] != '\0') return false;
    }
    return is_printable_utf8(view);
}

Result<void, WireError> check(const Hello& hello) {
    if (hello.protocol_min > hello.protocol_max || hello.role > Role::kBoard ||
        hello.shape_count > kMaxShapes || hello.marker_count > kMaxMarkers) {
        return failure(WireError::kRange);
    }
    if (!is_good_text(hello.firmware) || !is_good_text(hello.serial) || !is_good_text(hello.board)) {
        return failure(WireError::kText);
    }
    return {};
}

}  // namespace

Result<std::size_t, WireError> encode(const Hello& hello, MutableByteSpan into) {
    if (const auto checked = check(hello); !checked) return failure(checked.error());
    ByteWriter writer(into);
    writer.write(hello.protocol_min);
    writer.write(hello.protocol_max);
    writer.write(hello.role);
    writer.write(static_cast<std::uint8_t>((hello.pack_loaded ? kPackLoadedBit : 0U) |
                                           (hello.pack_unsigned ? kPackUnsignedBit : 0U)));
    writer.write(hello.session_id);
    writer.write(hello.capabilities);
    writer.write(hello.shape_count);
    writer.write(hello.marker_count);
    writer.write(hello.rate_mhz);
    writer.write(hello.pack_hash);
    write_text(writer, hello.firmware);
    write_text(writer, hello.serial);
    write_text(writer, hello.board);
    return finished(writer);
}

Result<Hello, WireError> decode_hello(ByteSpan payload) {
    if (payload.size() != kHelloBytes) return failure(WireError::kLength);
    ByteReader reader(payload);
    Hello hello;
    hello.protocol_min = reader.read<std::uint8_t>();
    hello.protocol_max = reader.read<std::uint8_t>();
    hello.role = reader.read<Role>();
    const auto flags = reader.read<std::uint8_t>();
    hello.pack_loaded = (flags & kPackLoadedBit) != 0;
    hello.pack_unsigned = (flags & kPackUnsignedBit) != 0;
    hello.session_id = reader.read<std::uint32_t>();
    hello.capabilities = reader.read<std::uint32_t>();
    hello.shape_count = reader.read<std::uint16_t>();
    hello.marker_count = reader.read<std::uint16_t>();
    hello.rate_mhz = reader.read<std::uint32_t>();
    hello.pack_hash = reader.read<std::array<std::uint8_t, 8>>();
    hello.firmware = read_text<24>(reader);
    hello.serial = read_text<32>(reader);
    hello.board = read_text<24>(reader);
    if ((flags & ~kHelloFlags) != 0) return failure(WireError::kRange);
    if (const auto checked = check(hello); !checked) return failure(checked.error());
    if (hello.protocol_min > kWireProtocol || hello.protocol_max < kWireProtocol)
        return failure(WireError::kVersion);
    return hello;
}

Result<std::size_t, WireError> encode(const NamesRequest& request, MutableByteSpan into) {
    if (request.kind > NameKind::kMarkers) return failure(WireError::kRange);
    ByteWriter writer(into);
    writer.write(request.kind);
    write_zeros(writer, 1);
    writer.write(request.first);
    return finished(writer);
}

Result<NamesRequest, WireError> decode_names_request(ByteSpan payload) {
    if (payload.size() != 4) return failure(WireError::kLength);
    ByteReader reader(payload);
    NamesRequest request;
    request.kind = reader.read<NameKind>();
    const bool reserved_zero = read_zeros(reader, 1);
    request.first = reader.read<std::uint16_t>();
    if (request.kind > NameKind::kMarkers || !reserved_zero) return failure(WireError::kRange);
    return request;
}

namespace {

constexpr std::size_t kNamesHeadBytes = 8;

constexpr std::size_t most_names(NameKind kind) {
    return kind == NameKind::kShapes ? kMaxShapes : kMaxMarkers;
}

bool is_good_name(std::string_view name) {
    return !name.empty() && name.size() <= kMaxNameBytes && is_printable_utf8(name);
}

// Names from `first` that fit into `space` bytes.
std::size_t names_that_fit(std::span<const std::string_view> all, std::size_t first, std::size_t space) {
    std::size_t count = 0;
    while (first + count < all.size() && all[first + count].size() + 1 <= space) {
        space -= all[first + count].size() + 1;
        ++count;
    }
    return count;
}

}  // namespace

Result<std::size_t, WireError> encode_names(NameKind kind, std::span<const std::string_view> all,
                                            std::uint16_t first, MutableByteSpan into) {
    if (kind > NameKind::kMarkers || all.size() > most_names(kind) || first > all.size()) {
        return failure(WireError::kRange);
    }
    const std::size_t space = into.size() < kMaxWirePayloadBytes ? into.size() : kMaxWirePayloadBytes;
    if (space < kNamesHeadBytes) return failure(WireError::kSpace);
    const std::size_t count = names_that_fit(all, first, space - kNamesHeadBytes);
    ByteWriter writer(into);
    writer.write(kind);
    write_zeros(writer, 1);
    writer.write(static_cast<std::uint16_t>(all.size()));
    writer.write(first);
    writer.write(static_cast<std::uint16_t>(count));
    for (const std::string_view name : all.subspan(first, count)) {
        if (!is_good_name(name)) return failure(WireError::kText);
        writer.write(static_cast<std::uint8_t>(name.size()));
        writer.write_bytes(std::as_bytes(std::span(name.data(), name.size())));
    }
    if (count == 0 && first < all.size()) {
        return failure(is_good_name(all[first]) ? WireError::kSpace : WireError::kText);
    }
    return finished(writer);
}

Result<NamesPage, WireError> decode_names(ByteSpan payload) {
    ByteReader reader(payload);
    NamesPage page;
    page.kind = reader.read<NameKind>();
    const bool reserved_zero = read_zeros(reader, 1);
    page.total = reader.read<std::uint16_t>();
    page.first = reader.read<std::uint16_t>();
    page.count = reader.read<std::uint16_t>();
    if (!reader.ok()) return failure(WireError::kLength);
    if (page.kind > NameKind::kMarkers || !reserved_zero || page.total > most_names(page.kind) ||
        page.first > page.total || page.count > page.total - page.first) {
        return failure(WireError::kRange);
    }
    // A page before the end that holds nothing would make the asker ask for ever.
    if (page.count == 0 && page.first < page.total) return failure(WireError::kRange);
    for (std::size_t i = 0; i < page.count; ++i) {
        const auto size = reader.read<std::uint8_t>();
        const ByteSpan bytes = reader.read_bytes(size);
        if (!reader.ok()) return failure(WireError::kLength);
        page.names[i] = {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
        if (!is_good_name(page.names[i])) return failure(WireError::kText);
    }
    if (reader.remaining() != 0) return failure(WireError::kLength);
    return page;
}

Result<std::size_t, WireError> encode(const TimeRequest& request, MutableByteSpan into) {
    if (!is_wire_time(request.host_sent_us)) return failure(WireError::kRange);
    ByteWriter writer(into);
    writer.write(request.host_sent_us);
    return finished(writer);
}

Result<TimeRequest, WireError> decode_time_request(ByteSpan payload) {
    if (payload.size() != sizeof(std::int64_t)) return failure(WireError::kLength);
    const TimeRequest request{load<std::int64_t>(payload, 0)};
    if (!is_wire_time(request.host_sent_us)) return failure(WireError::kRange);
    return request;
}

namespace {

bool in_range(const TimeReply& reply) {
    return is_wire_time(reply.host_sent_us) && is_wire_time(reply.board_received_us) &&
           is_wire_time(reply.board_sent_us) && reply.board_sent_us >= reply.board_received_us;
}

}  // namespace

Result<std::size_t, WireError> encode(const TimeReply& reply, MutableByteSpan into) {
    if (!in_range(reply)) return failure(WireError::kRange);
    ByteWriter writer(into);
    writer.write(reply.host_sent_us);
    writer.write(reply.board_received_us);
    writer.write(reply.board_sent_us);
    return finished(writer);
}

Result<TimeReply, WireError> decode_time_reply(ByteSpan payload) {
    if (payload.size() != 3 * sizeof(std::int64_t)) return failure(WireError::kLength);
    ByteReader reader(payload);
    TimeReply reply;
    reply.host_sent_us = reader.read<std::int64_t>();
    reply.board_received_us = reader.read<std::int64_t>();
    reply.board_sent_us = reader.read<std::int64_t>();
    if (!in_range(reply)) return failure(WireError::kRange);
    return reply;
}

namespace {

bool is_good_mask(std::uint8_t mask) {
    return mask != 0 && (mask & ~(kAllStreams | kStreamHead)) == 0;
}

bool in_range(const StartStreams& start) {
    return is_good_mask(start.mask) && start.weights_divider > 0 && start.markers_divider > 0 &&
           start.status_divider > 0;
}

}  // namespace

Result<std::size_t, WireError> encode(const StartStreams& start, MutableByteSpan into) {
    if (!in_range(start)) return failure(WireError::kRange);
    ByteWriter writer(into);
    writer.write(start.mask);
    write_zeros(writer, 1);
    writer.write(start.weights_divider);
    writer.write(start.markers_divider);
    writer.write(start.status_divider);
    return finished(writer);
}

Result<StartStreams, WireError> decode_start_streams(ByteSpan payload) {
    if (payload.size() != 8) return failure(WireError::kLength);
    ByteReader reader(payload);
    StartStreams start;
    start.mask = reader.read<std::uint8_t>();
    const bool reserved_zero = read_zeros(reader, 1);
    start.weights_divider = reader.read<std::uint16_t>();
    start.markers_divider = reader.read<std::uint16_t>();
    start.status_divider = reader.read<std::uint16_t>();
    if (!in_range(start) || !reserved_zero) return failure(WireError::kRange);
    return start;
}

Result<std::size_t, WireError> encode(const StopStreams& stop, MutableByteSpan into) {
    if (!is_good_mask(stop.mask)) return failure(WireError::kRange);
    ByteWriter writer(into);
    writer.write(stop.mask);
    return finished(writer);
}

Result<StopStreams, WireError> decode_stop_streams(ByteSpan payload) {
    if (payload.size() != 1) return failure(WireError::kLength);
    const StopStreams stop{load<std::uint8_t>(payload, 0)};
    if (!is_good_mask(stop.mask)) return failure(WireError::kRange);
    return stop;
}

namespace {

bool in_range(const CommandMessage& command) {
    return command.command >= BoardCommand::kResetTracking && command.command <= BoardCommand::kForgetNeutral;
}

}  // namespace

Result<std::size_t, WireError> encode(const CommandMessage& command, MutableByteSpan into) {
    if (!in_range(command)) return failure(WireError::kRange);
    ByteWriter writer(into);
    writer.write(command.command);
    return finished(writer);
}

Result<CommandMessage, WireError> decode_command(ByteSpan payload) {
    if (payload.size() != 1) return failure(WireError::kLength);
    const CommandMessage command{load<BoardCommand>(payload, 0)};
    if (!in_range(command)) return failure(WireError::kRange);
    return command;
}

namespace {

Result<void, WireError> check(const EventMessage& event) {
    const bool is_log = event.kind == EventKind::kLog;
    if (!is_wire_time(event.time_us) || event.kind > EventKind::kLog || event.level > EventLevel::kError ||
        event.fault > 64 || is_log != (event.fault == 0) ||
        (event.camera >= kMaxCameras && event.camera != kNoCamera)) {
        return failure(WireError::kRange);
    }
    if (!is_good_text(event.text)) return failure(WireError::kText);
    return {};
}

}  // namespace

Result<std::size_t, WireError> encode(const EventMessage& event, MutableByteSpan into) {
    if (const auto checked = check(event); !checked) return failure(checked.error());
    ByteWriter writer(into);
    writer.write(event.time_us);
    writer.write(event.kind);
    writer.write(event.level);
    writer.write(event.fault);
    writer.write(event.camera);
    writer.write(event.count);
    write_text(writer, event.text);
    return finished(writer);
}

Result<EventMessage, WireError> decode_event(ByteSpan payload) {
    if (payload.size() != 136) return failure(WireError::kLength);
    ByteReader reader(payload);
    EventMessage event;
    event.time_us = reader.read<std::int64_t>();
    event.kind = reader.read<EventKind>();
    event.level = reader.read<EventLevel>();
    event.fault = reader.read<std::uint8_t>();
    event.camera = reader.read<std::uint8_t>();
    event.count = reader.read<std::uint32_t>();
    event.text = read_text<120>(reader);
    if (const auto checked = check(event); !checked) return failure(checked.error());
    return event;
}

NakReason nak_reason(WireError error) {
    switch (error) {
        case WireError::kLength:
            return NakReason::kBadLength;
        case WireError::kVersion:
            return NakReason::kVersion;
        case WireError::kSpace:
        case WireError::kRange:
        case WireError::kText:
            break;
    }
    return NakReason::kBadValue;
}

Result<std::size_t, WireError> encode(const NakMessage& nak, MutableByteSpan into) {
    if (nak.reason < NakReason::kUnknownType || nak.reason > NakReason::kNotNow)
        return failure(WireError::kRange);
    ByteWriter writer(into);
    writer.write(nak.reason);
    writer.write(nak.type);
    write_zeros(writer, 2);
    writer.write(nak.sequence);
    return finished(writer);
}

Result<NakMessage, WireError> decode_nak(ByteSpan payload) {
    if (payload.size() != 8) return failure(WireError::kLength);
    ByteReader reader(payload);
    NakMessage nak;
    nak.reason = reader.read<NakReason>();
    nak.type = reader.read<std::uint8_t>();
    const bool reserved_zero = read_zeros(reader, 2);
    nak.sequence = reader.read<std::uint32_t>();
    if (nak.reason < NakReason::kUnknownType || nak.reason > NakReason::kNotNow || !reserved_zero) {
        return failure(WireError::kRange);
    }
    return nak;
}

Result<std::size_t, WireError> encode(const AckMessage& ack, MutableByteSpan into) {
    ByteWriter writer(into);
    writer.write(ack.type);
    write_zeros(writer, 3);
    writer.write(ack.sequence);
    return finished(writer);
}

Result<AckMessage, WireError> decode_ack(ByteSpan payload) {
    if (payload.size() != 8) return failure(WireError::kLength);
    ByteReader reader(payload);
    AckMessage ack;
    ack.type = reader.read<std::uint8_t>();
    const bool reserved_zero = read_zeros(reader, 3);
    ack.sequence = reader.read<std::uint32_t>();
    if (!reserved_zero) return failure(WireError::kRange);
    return ack;
}

Result<std::size_t, WireError> encode(const GoodbyeMessage& goodbye, MutableByteSpan into) {
    if (goodbye.reason > GoodbyeReason::kFailed) return failure(WireError::kRange);
    ByteWriter writer(into);
    writer.write(goodbye.reason);
    return finished(writer);
}

Result<GoodbyeMessage, WireError> decode_goodbye(ByteSpan payload) {
    if (payload.size() != 1) return failure(WireError::kLength);
    const GoodbyeMessage goodbye{load<GoodbyeReason>(payload, 0)};
    if (goodbye.reason > GoodbyeReason::kFailed) return failure(WireError::kRange);
    return goodbye;
}

Result<void, WireError> decode_empty(ByteSpan payload) {
    if (!payload.empty()) return failure(WireError::kLength);
    return {};
}

}  // namespace rig
