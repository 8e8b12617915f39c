#include "tests/support/wire/simulated_board.hpp"

#include "tests/support/wire/messages.hpp"

namespace rig::test {

namespace {

constexpr std::size_t kMostUnsent = 64;  // frames; older ones go first, as latest-wins has it

std::vector<std::string_view> views(const std::vector<std::string>& names) {
    return {names.begin(), names.end()};
}

}  // namespace

SimulatedBoard::SimulatedBoard(ByteLink& link, const BoardOptions& options) : link_(link), options_(options) {
    for (std::size_t i = 0; i < options_.shape_count; ++i)
        shape_names_.push_back("shape_" + std::to_string(i));
    for (std::size_t i = 0; i < options_.marker_count; ++i)
        marker_names_.push_back("marker_" + std::to_string(i));
}

float SimulatedBoard::weight_of(std::uint32_t tick, std::size_t shape) {
    return static_cast<float>((tick + 7 * shape) % 1024) / 1024.0F;
}

void SimulatedBoard::restart(std::uint32_t session_id) {
    options_.session_id = session_id;
    sequence_ = 0;
    tick_ = 0;
    streams_ = 0;
    unsent_.clear();
}

void SimulatedBoard::say_goodbye() {
    send(MessageType::kGoodbye, GoodbyeMessage{GoodbyeReason::kShutdown});
    streams_ = 0;
    flush();
}

void SimulatedBoard::poll(std::int64_t now_us) {
    std::array<std::byte, 4096> buffer;
    for (int i = 0; i < 16; ++i) {
        const auto got = link_.read(buffer);
        if (!got) {
            (void)link_.open();
            return;
        }
        if (*got == 0) break;
        ByteSpan chunk = ByteSpan(buffer).first(*got);
        FrameView frame;
        while (decoder_.next(chunk, frame)) take(frame, now_us);
    }
    if (!next_tick_us_) next_tick_us_ = now_us;
    while (now_us >= *next_tick_us_) {
        tick(*next_tick_us_);
        *next_tick_us_ += options_.tick_us;
    }
    flush();
}

void SimulatedBoard::take(const FrameView& frame, std::int64_t now_us) {
    const std::int64_t board_us = now_us + options_.clock_ahead_us;
    switch (frame.head.type) {
        case MessageType::kHelloRequest:
            return send_hello();
        case MessageType::kHello:
            return answer(frame, decode_hello(frame.payload).has_value());
        case MessageType::kNamesRequest:
            if (const auto request = decode_names_request(frame.payload)) send_names(*request);
            return;
        case MessageType::kTimeRequest:
            if (const auto request = decode_time_request(frame.payload)) {
                send(MessageType::kTimeReply, TimeReply{request->host_sent_us, board_us, board_us});
            }
            return;
        case MessageType::kStatusRequest:
            return send_status(now_us);
        case MessageType::kStartStreams:
            if (const auto start = decode_start_streams(frame.payload)) {
                if ((start->mask & kStreamHead) != 0 && !options_.tells_head) return answer(frame, false);
                streams_ |= start->mask;
                dividers_ = *start;
            }
            return answer(frame, true);
        case MessageType::kStopStreams:
            streams_ = 0;
            return answer(frame, true);
        case MessageType::kCommand:
            ++commands_;
            return answer(frame, true);
        case MessageType::kControl: {
            const auto message = decode_control(frame.payload);
            if (message && !options_.busy) controls_.push_back(*message);
            return answer(frame, message.has_value());
        }
        case MessageType::kGoodbye:
            ++goodbyes_;
            return;
        default:
            return;
    }
}

void SimulatedBoard::answer(const FrameView& frame, bool good) {
    const auto type = static_cast<std::uint8_t>(frame.head.type);
    if (options_.busy)
        return send(MessageType::kNak, NakMessage{NakReason::kBusy, type, frame.head.sequence});
    if (!good) return send(MessageType::kNak, NakMessage{NakReason::kBadValue, type, frame.head.sequence});
    send(MessageType::kAck, AckMessage{type, frame.head.sequence});
}

void SimulatedBoard::tick(std::int64_t now_us) {
    FaceState state;
    state.sequence = tick_;
    state.capture_us = now_us + options_.clock_ahead_us - options_.capture_delay_us;
    state.age_us = options_.capture_delay_us;
    state.state = TrackingState::kLive;
    state.held = false;
    state.faults = options_.faults;
    state.cameras[0] = CameraStatus::kGood;
    state.cameras[1] = CameraStatus::kGood;
    state.shape_count = static_cast<std::uint16_t>(options_.shape_count);
    MarkerFrame markers;
    markers.sequence = tick_;
    markers.capture_us = state.capture_us;
    markers.marker_count = static_cast<std::uint16_t>(options_.marker_count);
    for (std::size_t i = 0; i < options_.shape_count; ++i) {
        state.weights[i] = weight_of(tick_, i);
        state.confidence[i] = 1.0F;
    }
    for (std::size_t i = 0; i + 1 < options_.marker_count; ++i) {  // the last is never seen
        markers.markers[i] = {true, 2, {static_cast<float>(i), static_cast<float>(tick_ % 100), -1.5F}};
    }
    std::array<std::byte, kMaxWirePayloadBytes> payload;
    if ((streams_ & kStreamWeights) != 0 && tick_ % dividers_.weights_divider == 0) {
        if ((streams_ & kStreamHead) != 0) {
            HeadPlace head;
            head.status = tick_ % 4 == 3 ? HeadStatus::kTooFew : HeadStatus::kKnown;
            head.capture_us = state.capture_us;
            head.translation_mm = {static_cast<float>(tick_), 0.0F, -2.5F};
            send(MessageType::kHeadPose, HeadPoseMessage{tick_, head});
        }
        for (std::size_t part = 0; part < weights_part_count(state.shape_count); ++part) {
            const auto size = encode_weights(state, part, payload);
            send(MessageType::kWeights, ByteSpan(payload).first(size.value_or(0)));
        }
    }
    if ((streams_ & kStreamMarkers) != 0 && tick_ % dividers_.markers_divider == 0) {
        for (std::size_t part = 0; part < markers_part_count(markers.marker_count); ++part) {
            const auto size = encode_markers(markers, part, payload);
            send(MessageType::kMarkers, ByteSpan(payload).first(size.value_or(0)));
        }
    }
    if ((streams_ & kStreamStatus) != 0 && tick_ % dividers_.status_divider == 0) send_status(now_us);
    ++tick_;
}

void SimulatedBoard::send_hello() {
    Hello hello;
    hello.role = Role::kBoard;
    hello.pack_loaded = true;
    hello.pack_unsigned = true;
    hello.session_id = options_.session_id;
    hello.capabilities = kCanStreamMarkers | kCanResetTracking | kIsSimulated;
    if (options_.tells_head) hello.capabilities |= kCanStreamHead;
    hello.shape_count = static_cast<std::uint16_t>(options_.shape_count);
    hello.marker_count = static_cast<std::uint16_t>(options_.marker_count);
    hello.rate_mhz = 60000;
    hello.firmware = FixedText<24>("9.9.9");
    hello.serial = FixedText<32>("test-rig");
    hello.board = FixedText<24>("sim");
    send(MessageType::kHello, hello);
}

void SimulatedBoard::send_names(const NamesRequest& request) {
    const auto all = views(request.kind == NameKind::kShapes ? shape_names_ : marker_names_);
    std::array<std::byte, kMaxWirePayloadBytes> payload;
    const auto size = encode_names(request.kind, all, request.first, payload);
    if (size) send(MessageType::kNames, ByteSpan(payload).first(*size));
}

void SimulatedBoard::send_status(std::int64_t now_us) {
    Health health;
    health.now_us = now_us + options_.clock_ahead_us;
    health.uptime_us = 1000000;
    health.ticks = tick_;
    health.solved = tick_;
    health.state = TrackingState::kLive;
    health.faults = options_.faults;
    for (std::size_t bit = 0; bit < 64; ++bit) health.fault_counts[bit] = (options_.faults >> bit) & 1U;
    health.camera_good = {tick_, tick_, 0, 0};
    health.observations = {5, 6, 0, 0};
    health.peak_memory_kb = 20000;
    health.solve = {1000, 2000, 3000};
    health.latency = {8000, 9000, 10000};
    send(MessageType::kStatus, health);
}

template <class Message>
void SimulatedBoard::send(MessageType type, const Message& message) {
    std::array<std::byte, kMaxWirePayloadBytes> payload;
    const auto size = encode(message, payload);
    send(type, ByteSpan(payload).first(size.value_or(0)));
}

void SimulatedBoard::send(MessageType type, ByteSpan payload) {
    const std::uint32_t sequence = sequence_++;
    if (muted_) return;
    if (options_.lose_every != 0 && sequence % options_.lose_every == options_.lose_every - 1) {
        ++lost_;
        return;
    }
    if (unsent_.size() >= kMostUnsent)
        unsent_.erase(unsent_.begin() + 1);  // never the one that is partly out
    unsent_.push_back(framed({type, 0, kSourceBoard, sequence}, payload));
}

void SimulatedBoard::flush() {
    while (!unsent_.empty()) {
        std::vector<std::byte>& frame = unsent_.front();
        const auto taken = link_.write(frame);
        if (!taken || *taken == 0) return;
        frame.erase(frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(*taken));
        if (!frame.empty()) return;
        unsent_.pop_front();
    }
}

}  // namespace rig::test
