#include "firmware_host/companion/links/host_session.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace rig::host {

namespace {

constexpr std::int64_t kAskAgain_us = 250'000;  // PROTOCOL.md section 2
constexpr std::int64_t kRefusedPause_us = 1'000'000;
constexpr std::int64_t kSilence_us =
    2'500'000;  // then the greeting begins anew; the clocks alone speak once a second
constexpr std::int64_t kNoWeights_us = 1'000'000;  // then the streams are asked for anew
constexpr std::int64_t kTimeEvery_us = 1'000'000;  // keeps the session too: its owner is forgotten after 5 s
constexpr std::int64_t kTimeAtFirst_us = 20'000;   // until the filter has something to choose from
constexpr std::uint32_t kTimesAtFirst = 8;
constexpr std::size_t kMostUnsentBytes = 8192;  // requests are repeated, so more would only be old
constexpr std::size_t kReadBytes = 65536;       // a whole datagram of any size
constexpr int kReadsAPoll = 16;
constexpr std::uint32_t kLargestGap = 1U << 20;  // more is a restart, not loss
constexpr std::uint32_t kReorderWindow = 64;     // frames that a network may deliver late

bool is_due(const std::optional<std::int64_t>& last_us, std::int64_t now_us, std::int64_t period_us) {
    return !last_us || now_us - *last_us >= period_us;
}

}  // namespace

HostSession::HostSession(ByteLink& link, SessionOptions options, SessionEvents events)
    : link_(link), options_(std::move(options)), events_(std::move(events)), received_(kReadBytes) {}

void HostSession::poll(std::int64_t now_us) {
    if (phase_ == SessionPhase::kClosed) open_again(now_us);
    if (phase_ == SessionPhase::kClosed) return;
    receive(now_us);
    if (phase_ == SessionPhase::kClosed) {
        tried_us_ = now_us;
        return;
    }
    watch_silence(now_us);
    ask(now_us);
    flush();
    if (phase_ == SessionPhase::kClosed) tried_us_ = now_us;
}

void HostSession::open_again(std::int64_t now_us) {
    if (now_us - tried_us_ < kAskAgain_us) return;
    tried_us_ = now_us;
    if (!link_.open()) return;
    decoder_.reset();
    enter(SessionPhase::kGreeting);
}

void HostSession::lose_link(std::int64_t now_us) {
    ++counters_.links_lost;
    link_.close();
    unsent_.clear();
    tried_us_ = now_us;
    enter(SessionPhase::kClosed);
}

void HostSession::receive(std::int64_t now_us) {
    for (int i = 0; i < kReadsAPoll; ++i) {
        const auto got = link_.read(received_);
        if (!got) {
            lose_link(now_us);
            return;
        }
        if (*got == 0) return;
        ByteSpan chunk = ByteSpan(received_).first(*got);
        FrameView frame;
        while (decoder_.next(chunk, frame)) take(frame, now_us);
    }
}

void HostSession::take(const FrameView& frame, std::int64_t now_us) {
    if (frame.head.source == kSourceHost) return;  // an echo of our own, or another host on a shared line
    last_heard_us_ = now_us;
    count_frame_gap(frame.head.sequence);
    if (events_.raw) {
        std::array<std::byte, kMaxWireFrameBytes> whole;
        const auto size = encode_frame(frame.head, frame.payload, whole);
        if (size) events_.raw(ByteSpan(whole).first(*size), now_us);
    }
    take_message(frame, now_us);
}

void HostSession::take_message(const FrameView& frame, std::int64_t now_us) {
    switch (frame.head.type) {
        case MessageType::kHello:
            return take_hello(decode_hello(frame.payload));
        case MessageType::kNames:
            return take_names(frame.payload);
        case MessageType::kTimeReply:
            return take_time(frame.payload, now_us);
        case MessageType::kGoodbye:
            if (phase_ != SessionPhase::kRefused) enter(SessionPhase::kGreeting);
            return;
        case MessageType::kWeights:
            return take_weights(frame.payload, now_us);
        case MessageType::kHeadPose:
            return take_head(frame.payload);
        case MessageType::kMarkers:
            return take_markers(frame.payload, now_us);
        case MessageType::kStatus:
            return take_status(frame.payload);
        case MessageType::kEvent:
            return take_event(frame.payload);
        case MessageType::kAck:
            return take_ack(frame.payload);
        case MessageType::kNak:
            return take_nak(frame.payload);
        default:
            ++counters_.unknown;
    }
}

void HostSession::take_hello(const Result<Hello, WireError>& hello) {
    if (!hello) {
        ++counters_.refused;
        if (hello.error() == WireError::kVersion)
            refuse("host and board speak different versions of the protocol");
        return;
    }
    if (hello->role != Role::kBoard) return;
    const bool same_board = hello_ && hello_->session_id == hello->session_id;
    if (hello_ && !same_board) ++counters_.restarts;
    if (!same_board || hello_->pack_hash != hello->pack_hash) {
        shape_names_.clear();
        marker_names_.clear();
        shapes_done_ = false;
        markers_done_ = false;
    }
    if (!same_board) {
        states_.reset();
        markers_.reset();
        head_.reset();
        time_sync_.reset();
        times_asked_ = 0;
        last_state_.reset();
    }
    hello_ = *hello;
    if (phase_ == SessionPhase::kGreeting || !same_board) after_greeting();
}

void HostSession::after_greeting() {
    if (options_.streams != 0) {
        enter(SessionPhase::kClaiming);
    } else {
        enter(SessionPhase::kNaming);
        after_naming();
    }
}

// Goes on to the next kind of names that is wanted and not there, then to the streams.
void HostSession::after_naming() {
    if (options_.names && !shapes_done_) {
        naming_ = NameKind::kShapes;
    } else if (options_.names && !markers_done_) {
        naming_ = NameKind::kMarkers;
    } else {
        enter(options_.streams != 0 ? SessionPhase::kStarting : SessionPhase::kReady);
    }
}

void HostSession::take_names(ByteSpan payload) {
    const auto page = decode_names(payload);
    if (!page) {
        ++counters_.refused;
        return;
    }
    std::vector<std::string>& names = naming_ == NameKind::kShapes ? shape_names_ : marker_names_;
    if (phase_ != SessionPhase::kNaming || page->kind != naming_ || page->first != names.size()) return;
    for (std::size_t i = 0; i < page->count; ++i) names.emplace_back(page->names[i]);
    asked_us_.reset();
    if (names.size() < page->total) return;
    (naming_ == NameKind::kShapes ? shapes_done_ : markers_done_) = true;
    after_naming();
}

void HostSession::take_ack(ByteSpan payload) {
    const auto ack = decode_ack(payload);
    if (!ack) {
        ++counters_.refused;
        return;
    }
    const auto type = static_cast<MessageType>(ack->type);
    if (type == MessageType::kControl && !controls_.empty() && ack->sequence == control_sequence_) {
        controls_.pop_front();
        control_asked_us_.reset();
    }
    if (type == MessageType::kCommand && ack->sequence == command_sequence_) command_answered_ = true;
    if (phase_ == SessionPhase::kClaiming && type == MessageType::kHello) {
        refusal_.clear();
        enter(SessionPhase::kNaming);
        after_naming();
    } else if (phase_ == SessionPhase::kStarting && type == MessageType::kStartStreams) {
        enter(SessionPhase::kReady);
    }
}

void HostSession::take_nak(ByteSpan payload) {
    const auto nak = decode_nak(payload);
    if (!nak) {
        ++counters_.refused;
        return;
    }
    const auto type = static_cast<MessageType>(nak->type);
    if (type == MessageType::kControl && !controls_.empty() && nak->sequence == control_sequence_) {
        control_refusal_ = nak->reason;
        controls_.clear();
    }
    if (type == MessageType::kCommand && nak->sequence == command_sequence_) {
        command_answered_ = true;
        command_refusal_ = nak->reason;
    }
    if (type != MessageType::kHello && type != MessageType::kStartStreams) return;
    switch (nak->reason) {
        case NakReason::kBusy:
            return refuse("another host owns the session; end it there, or wait 5 s after it has gone");
        case NakReason::kVersion:
            return refuse("host and board speak different versions of the protocol; update the older one");
        case NakReason::kDenied:
            return refuse("the board does not allow this over this link");
        case NakReason::kNotNow:
            return refuse("the board cannot stream in its present state");
        case NakReason::kUnknownType:
        case NakReason::kBadLength:
        case NakReason::kBadValue:
            return refuse("the board does not understand this program; update the older one");
    }
}

void HostSession::take_weights(ByteSpan payload, std::int64_t now_us) {
    const auto part = decode_weights(payload);
    if (!part) {
        ++counters_.refused;
        return;
    }
    last_weights_us_ = now_us;
    if (!states_.push(*part)) return;
    whole_ = states_.state();
    if (head_ && head_->sequence == whole_.sequence) whole_.head = head_->head;
    const FaceState& state = whole_;
    count_state_gap(state.sequence);
    ++counters_.states;
    if (!events_.state) return;
    ReceivedState received{state, states_.altered(), now_us, std::nullopt};
    if (const auto captured_us = time_sync_.host_time_us(state.capture_us))
        received.latency_us = now_us - *captured_us;
    events_.state(received);
}

// Comes before the weights of its tick; one whose weights are lost is replaced by the next.
void HostSession::take_head(ByteSpan payload) {
    const auto head = decode_head_pose(payload);
    if (!head) {
        ++counters_.refused;
        return;
    }
    head_ = *head;
}

void HostSession::take_markers(ByteSpan payload, std::int64_t now_us) {
    const auto part = decode_markers(payload);
    if (!part) {
        ++counters_.refused;
        return;
    }
    if (markers_.push(*part) && events_.markers) events_.markers(markers_.frame(), now_us);
}

void HostSession::take_time(ByteSpan payload, std::int64_t now_us) {
    const auto reply = decode_time_reply(payload);
    if (!reply || !time_sync_.add(*reply, now_us)) ++counters_.refused;
}

void HostSession::take_status(ByteSpan payload) {
    const auto health = decode_status(payload);
    if (!health) {
        ++counters_.refused;
        return;
    }
    status_wanted_ = false;
    if (events_.status) events_.status(*health);
}

void HostSession::take_event(ByteSpan payload) {
    const auto event = decode_event(payload);
    if (!event) {
        ++counters_.refused;
        return;
    }
    if (events_.event) events_.event(*event);
}

void HostSession::count_frame_gap(std::uint32_t sequence) {
    if (last_frame_ && *last_frame_ - sequence - 1 < kReorderWindow) {  // late: it was counted as lost
        if (counters_.frames_lost > 0) --counters_.frames_lost;
        return;
    }
    const std::uint32_t step = last_frame_ ? sequence - *last_frame_ : 1;
    if (step != 0 && step <= kLargestGap) counters_.frames_lost += step - 1;
    last_frame_ = sequence;
}

void HostSession::count_state_gap(std::uint32_t sequence) {
    const std::uint32_t expected = options_.weights_divider;
    const std::uint32_t step = last_state_ ? sequence - *last_state_ : expected;
    if (step > expected && step <= kLargestGap)
        counters_.states_missing += (step + expected - 1) / expected - 1;
    last_state_ = sequence;
}

void HostSession::enter(SessionPhase phase) {
    phase_ = phase;
    asked_us_.reset();
    if (phase == SessionPhase::kReady) last_weights_us_.reset();
}

// A board that is alive and was asked for weights sends them each tick, whatever its state.
void HostSession::watch_silence(std::int64_t now_us) {
    const bool established = phase_ == SessionPhase::kReady || phase_ == SessionPhase::kStarting ||
                             phase_ == SessionPhase::kNaming || phase_ == SessionPhase::kClaiming;
    if (established && last_heard_us_ && now_us - *last_heard_us_ > kSilence_us) {
        enter(SessionPhase::kGreeting);
        return;
    }
    if (phase_ != SessionPhase::kReady || (options_.streams & kStreamWeights) == 0) return;
    if (!last_weights_us_) last_weights_us_ = now_us;
    const std::int64_t patience_us = kNoWeights_us * std::max<std::int64_t>(1, options_.weights_divider / 30);
    if (now_us - *last_weights_us_ > patience_us) enter(SessionPhase::kGreeting);  // it may have restarted
}

void HostSession::ask(std::int64_t now_us) {
    ask_time(now_us);
    ask_control(now_us);
    if (command_ && phase_ == SessionPhase::kReady) {
        command_sequence_ = sequence_;
        send(MessageType::kCommand, CommandMessage{*command_});
        command_.reset();
    }
    if (status_wanted_ && hello_ && is_due(status_asked_us_, now_us, kAskAgain_us)) {
        status_asked_us_ = now_us;
        send(MessageType::kStatusRequest, ByteSpan{});
    }
    const std::int64_t period_us = phase_ == SessionPhase::kRefused ? kRefusedPause_us : kAskAgain_us;
    if (!is_due(asked_us_, now_us, period_us)) return;
    const bool first_time = !asked_us_;
    asked_us_ = now_us;
    switch (phase_) {
        case SessionPhase::kGreeting:
            return send(MessageType::kHelloRequest, ByteSpan{});
        case SessionPhase::kClaiming: {
            Hello hello;
            hello.session_id = options_.session_id;
            hello.firmware = FixedText<24>(options_.version);
            hello.serial = FixedText<32>(options_.name);
            return send(MessageType::kHello, hello);
        }
        case SessionPhase::kNaming:
            return ask_names();
        case SessionPhase::kStarting: {
            const int refused = tells_head() ? 0 : kStreamHead;  // by boards that do not know it
            return send(
                MessageType::kStartStreams,
                StartStreams{static_cast<std::uint8_t>(options_.streams & ~refused), options_.weights_divider,
                             options_.markers_divider, options_.status_divider});
        }
        case SessionPhase::kRefused:
            if (!first_time) enter(SessionPhase::kGreeting);
            return;
        case SessionPhase::kClosed:
        case SessionPhase::kReady:
            return;
    }
}

void HostSession::ask_names() {
    const std::vector<std::string>& names = naming_ == NameKind::kShapes ? shape_names_ : marker_names_;
    send(MessageType::kNamesRequest, NamesRequest{naming_, static_cast<std::uint16_t>(names.size())});
}

void HostSession::ask_control(std::int64_t now_us) {
    if (controls_.empty() || phase_ != SessionPhase::kReady) return;
    if (!is_due(control_asked_us_, now_us, kAskAgain_us)) return;
    control_asked_us_ = now_us;
    control_sequence_ = sequence_;
    send(MessageType::kControl, controls_.front());
}

void HostSession::ask_time(std::int64_t now_us) {
    const std::int64_t period_us = times_asked_ < kTimesAtFirst ? kTimeAtFirst_us : kTimeEvery_us;
    if (!hello_ || phase_ == SessionPhase::kGreeting || !is_due(time_asked_us_, now_us, period_us)) return;
    time_asked_us_ = now_us;
    ++times_asked_;
    send(MessageType::kTimeRequest, TimeRequest{now_us});
}

void HostSession::refuse(std::string why) {
    refusal_ = std::move(why);
    enter(SessionPhase::kRefused);
}

void HostSession::leave() {
    if (phase_ == SessionPhase::kClosed) return;
    unsent_.clear();
    if (options_.streams != 0 && hello_) {
        send(MessageType::kStopStreams, StopStreams{kAllStreams});
        send(MessageType::kGoodbye, GoodbyeMessage{GoodbyeReason::kDone});
    }
    flush();
}

void HostSession::send(MessageType type, ByteSpan payload) {
    if (unsent_.size() > kMostUnsentBytes) return;
    std::array<std::byte, kMaxWireFrameBytes> frame;
    const auto size = encode_frame({type, 0, kSourceHost, sequence_}, payload, frame);
    if (!size) return;
    ++sequence_;
    if (link_.is_datagram()) {
        if (!link_.write(ByteSpan(frame).first(*size))) enter(SessionPhase::kClosed);
        return;
    }
    unsent_.insert(unsent_.end(), frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(*size));
}

template <class Message>
void HostSession::send(MessageType type, const Message& message) {
    std::array<std::byte, kMaxWirePayloadBytes> payload;
    const auto size = encode(message, payload);
    if (size) send(type, ByteSpan(payload).first(*size));
}

void HostSession::flush() {
    while (!unsent_.empty()) {
        const auto taken = link_.write(unsent_);
        if (!taken) {
            ++counters_.links_lost;
            link_.close();
            unsent_.clear();
            enter(SessionPhase::kClosed);
            return;
        }
        if (*taken == 0) return;
        unsent_.erase(unsent_.begin(), unsent_.begin() + static_cast<std::ptrdiff_t>(*taken));
    }
}

}  // namespace rig::host
