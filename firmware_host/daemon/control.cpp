#include "firmware_host/daemon/control.hpp"

#include "core/wire/control_message.hpp"

namespace rig {

namespace {

constexpr int kReadsPerService = 4;
constexpr int kMessagesPerService = 16;
constexpr std::int64_t kOwnerSilence_us = 5'000'000;

}  // namespace

Control::Control(LinkPort& port, TickSolver& solver, const Clock& clock, const Clock& wall,
                 const BoardIdentity& identity)
    : port_(port), solver_(solver), clock_(clock), wall_(wall), identity_(identity) {
    if (identity_.first_streams.mask != 0) port_.start_streams(identity_.first_streams);
}

void Control::service() {
    int reads = 0;
    int messages = 0;
    FrameView frame;
    while (messages < kMessagesPerService) {
        if (next_frame(frame)) {
            ++messages;
            handle(frame);
        } else if (reads++ < kReadsPerService) {
            unread_ = ByteSpan(inbox_).first(port_.read(inbox_));
            if (unread_.empty()) break;
        } else {
            break;
        }
    }
    port_.note_received(decoder_.counters());
    if (owned_ && wall_.now_us() - heard_us_ > kOwnerSilence_us) owned_ = false;
}

bool Control::next_frame(FrameView& frame) {
    const std::uint64_t bad = decoder_.counters().bad();
    const bool found = decoder_.next(unread_, frame);
    if (decoder_.counters().bad() != bad) port_.raise(Fault::kLineNoise);
    return found;
}

void Control::handle(const FrameView& frame) {
    if (frame.head.source != kSourceHost) return;  // our own echo, or another board's
    if (!messages_.take(wall_.now_us())) {
        port_.raise(Fault::kCommandFlood);
        return;
    }
    heard_us_ = wall_.now_us();
    switch (frame.head.type) {
        case MessageType::kHelloRequest:
            if (!decode_empty(frame.payload)) return refuse(frame, NakReason::kBadLength);
            static_cast<void>(port_.reply(MessageType::kHello, identity_.hello));
            return;
        case MessageType::kHello:
            return handle_hello(frame);
        case MessageType::kNamesRequest:
            return handle_names(frame);
        case MessageType::kTimeRequest:
            return handle_time(frame);
        case MessageType::kGoodbye:
            return handle_goodbye(frame);
        case MessageType::kStartStreams:
            return handle_start(frame);
        case MessageType::kStopStreams:
            return handle_stop(frame);
        case MessageType::kStatusRequest:
            return handle_status(frame);
        case MessageType::kCommand:
            return handle_command(frame);
        case MessageType::kControl:
            return handle_control(frame);
        case MessageType::kAck:
        case MessageType::kNak:
            return;
        default:
            return refuse(frame, NakReason::kUnknownType);
    }
}

void Control::handle_hello(const FrameView& frame) {
    const auto hello = decode_hello(frame.payload);
    if (!hello) {
        if (hello.error() == WireError::kVersion) port_.raise(Fault::kProtocolVersion);
        return refuse(frame, nak_reason(hello.error()));
    }
    if (hello->role != Role::kHost) return refuse(frame, NakReason::kBadValue);
    const bool somebody_else = owned_ && owner_ != 0 && owner_ != hello->session_id;
    if (somebody_else) {
        port_.raise(Fault::kBusy);
        return refuse(frame, NakReason::kBusy);
    }
    owned_ = true;
    owner_ = hello->session_id;
    acknowledge(frame);
}

void Control::handle_names(const FrameView& frame) {
    const auto request = decode_names_request(frame.payload);
    if (!request) return refuse(frame, nak_reason(request.error()));
    const auto& names = request->kind == NameKind::kShapes ? identity_.shape_names : identity_.marker_names;
    std::array<std::byte, kMaxWirePayloadBytes> payload{};
    const auto length = encode_names(request->kind, names, request->first, payload);
    if (!length) return refuse(frame, NakReason::kBadValue);
    static_cast<void>(port_.reply(MessageType::kNames, ByteSpan(payload).first(*length)));
}

void Control::handle_time(const FrameView& frame) {
    const std::int64_t received_us = clock_.now_us();
    const auto request = decode_time_request(frame.payload);
    if (!request) return refuse(frame, nak_reason(request.error()));
    static_cast<void>(
        port_.reply(MessageType::kTimeReply, TimeReply{request->host_sent_us, received_us, clock_.now_us()}));
}

void Control::handle_goodbye(const FrameView& frame) {
    const auto goodbye = decode_goodbye(frame.payload);
    if (!goodbye) return refuse(frame, nak_reason(goodbye.error()));
    release_session();
}

void Control::release_session() {
    owned_ = false;
    owner_ = 0;
    port_.stop_streams(kAllStreams | kStreamHead);
    if (identity_.first_streams.mask != 0) port_.start_streams(identity_.first_streams);
}

void Control::handle_start(const FrameView& frame) {
    const auto start = decode_start_streams(frame.payload);
    if (!start) return refuse(frame, nak_reason(start.error()));
    const bool has_head = (identity_.hello.capabilities & kCanStreamHead) != 0;
    if ((start->mask & kStreamHead) != 0 && !has_head) return refuse(frame, NakReason::kBadValue);
    if (!owned_) owner_ = 0;
    owned_ = true;
    port_.start_streams(*start);
    acknowledge(frame);
}

void Control::handle_stop(const FrameView& frame) {
    const auto stop = decode_stop_streams(frame.payload);
    if (!stop) return refuse(frame, nak_reason(stop.error()));
    port_.stop_streams(stop->mask);
    acknowledge(frame);
}

void Control::handle_status(const FrameView& frame) {
    if (!decode_empty(frame.payload)) return refuse(frame, NakReason::kBadLength);
    port_.answer_status();
}

void Control::handle_command(const FrameView& frame) {
    const auto command = decode_command(frame.payload);
    if (!command) return refuse(frame, nak_reason(command.error()));
    const bool resets = command->command == BoardCommand::kResetTracking;
    if (!resets && identity_.shape_names.empty()) return refuse(frame, NakReason::kNotNow);
    if (resets) solver_.request_reset();
    if (command->command == BoardCommand::kNeutral) solver_.request_neutral();
    if (command->command == BoardCommand::kForgetNeutral) solver_.request_forget_neutral();
    acknowledge(frame);
}

// All edits of a message or none.
void Control::handle_control(const FrameView& frame) {
    const auto message = decode_control(frame.payload);
    if (!message) return refuse(frame, nak_reason(message.error()));
    if (identity_.shape_names.empty()) return refuse(frame, NakReason::kNotNow);
    ControlSet edited = message->neutral_first ? ControlSet{} : controls_;
    for (const ControlEdit& edit : message->edits) {
        if (!edit_controls(edit, identity_.shape_names.size(), edited))
            return refuse(frame, NakReason::kBadValue);
    }
    controls_ = edited;
    solver_.request_controls(controls_);
    acknowledge(frame);
}

void Control::acknowledge(const FrameView& frame) {
    static_cast<void>(port_.reply(
        MessageType::kAck, AckMessage{static_cast<std::uint8_t>(frame.head.type), frame.head.sequence}));
}

void Control::refuse(const FrameView& frame, NakReason reason) {
    if (reason != NakReason::kBusy && reason != NakReason::kNotNow) port_.raise(Fault::kBadCommand);
    if (!naks_.take(wall_.now_us())) return;
    static_cast<void>(
        port_.reply(MessageType::kNak,
                    NakMessage{reason, static_cast<std::uint8_t>(frame.head.type), frame.head.sequence}));
}

void Control::leave() {
    static_cast<void>(port_.reply(MessageType::kGoodbye, GoodbyeMessage{GoodbyeReason::kShutdown}));
}

}  // namespace rig
