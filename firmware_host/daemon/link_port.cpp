#include "firmware_host/daemon/link_port.hpp"

#include <algorithm>

namespace rig {

namespace {

constexpr std::int64_t kReopen_us = 50'000;    // well inside the 250 ms in which a stream must be back
constexpr std::int64_t kStalled_us = 500'000;  // F24

bool is_due(std::uint32_t now, std::uint32_t last, std::uint16_t divider, bool first) {
    return first || now - last >= divider;
}

}  // namespace

LinkPort::LinkPort(ByteLink& link, const Clock& clock, const Clock& wall, Vitals vitals)
    : link_(link), clock_(clock), wall_(wall), vitals_(vitals) {
    streams_.mask = 0;
}

bool LinkPort::open() {
    is_up_ = link_.open().has_value();
    retry_us_ = wall_.now_us() + kReopen_us;
    return is_up_;
}

void LinkPort::start_streams(const StartStreams& start) {
    streams_.mask |= start.mask;
    if ((start.mask & kStreamWeights) != 0) streams_.weights_divider = start.weights_divider;
    if ((start.mask & kStreamMarkers) != 0) streams_.markers_divider = start.markers_divider;
    if ((start.mask & kStreamStatus) != 0) streams_.status_divider = start.status_divider;
}

void LinkPort::offer(const TickOutput& output) {
    const std::uint32_t tick = output.state.sequence;
    Due due;
    due.weights = (streams_.mask & kStreamWeights) != 0 &&
                  is_due(tick, weights_at_, streams_.weights_divider, !any_offered_);
    due.head = due.weights && (streams_.mask & kStreamHead) != 0;
    due.markers = (streams_.mask & kStreamMarkers) != 0 &&
                  is_due(tick, markers_at_, streams_.markers_divider, !any_offered_);
    due.status = (streams_.mask & kStreamStatus) != 0 &&
                 is_due(tick, status_at_, streams_.status_divider, !any_offered_);
    if (due.weights) weights_at_ = tick;
    if (due.markers) markers_at_ = tick;
    if (due.status) status_at_ = tick;
    any_offered_ = true;
    if (is_waiting_ && waiting_due_.any()) {
        if (waiting_due_.weights) note_replaced();
        // The newer one stands in for what the older one owed.
        due.head |= waiting_due_.head;
        due.weights |= waiting_due_.weights;
        due.markers |= waiting_due_.markers;
        due.status |= waiting_due_.status;
    }
    waiting_ = output;
    waiting_due_ = due;
    is_waiting_ = true;
    tell_faults();
    tell_neutral();
}

bool LinkPort::reply(MessageType type, ByteSpan payload) {
    RIG_CHECK(payload.size() <= kMaxWirePayloadBytes);
    Reply entry;
    entry.type = type;
    entry.length = static_cast<std::uint16_t>(payload.size());
    std::copy(payload.begin(), payload.end(), entry.payload.begin());
    return replies_.push_back(entry);
}

bool LinkPort::drained() const {
    return frame_bytes_ == frame_sent_ && replies_.empty() && stage_ == Stage::kNothing && !status_wanted_ &&
           !(is_waiting_ && waiting_due_.any());
}

void LinkPort::pump_out() {
    reopen_when_due();
    while (is_up_ && flush() && load_next_frame()) {
    }
}

// True when no bytes of a begun frame are left.
bool LinkPort::flush() {
    while (frame_sent_ < frame_bytes_) {
        const auto taken = link_.write(ByteSpan(frame_).subspan(frame_sent_, frame_bytes_ - frame_sent_));
        if (!taken && taken.error() == LinkError::kClosed) lose_link();
        if (!is_up_) return false;
        const std::size_t count = taken.value_or(0);
        watch_stall(count > 0);
        if (count == 0) return false;
        frame_sent_ += count;
        bytes_taken_ += count;
        if (frame_sent_ == frame_bytes_) finish_frame();
    }
    return true;
}

void LinkPort::watch_stall(bool took) {
    if (took) {
        blocked_since_us_ = -1;
        stalled_ = false;
        return;
    }
    const std::int64_t now_us = wall_.now_us();
    if (blocked_since_us_ < 0) blocked_since_us_ = now_us;
    stalled_ = now_us - blocked_since_us_ > kStalled_us;
}

void LinkPort::put_frame(MessageType type, ByteSpan payload) {
    FrameHead head;
    head.type = type;
    head.source = kSourceBoard;
    head.sequence = sequence_++;
    const auto length = encode_frame(head, payload, frame_);
    frame_bytes_ = length.value_or(0);
    frame_sent_ = 0;
}

bool LinkPort::load_next_frame() {
    skip_undue_stages();
    const bool between_messages = stage_ == Stage::kNothing || part_ == 0;
    if (between_messages && !replies_.empty()) {
        const Reply next = replies_.pop_front();
        put_frame(next.type, ByteSpan(next.payload).first(next.length));
        return true;
    }
    const bool wanted = (is_waiting_ && waiting_due_.any()) || status_wanted_;
    if (stage_ == Stage::kNothing && wanted) begin_waiting();
    return load_stream_frame();
}

void LinkPort::skip_undue_stages() {
    if (stage_ == Stage::kHead && !sending_due_.head) stage_ = Stage::kWeights;
    if (stage_ == Stage::kWeights && !sending_due_.weights) stage_ = Stage::kMarkers;
    if (stage_ == Stage::kMarkers && !sending_due_.markers) stage_ = Stage::kStatus;
    if (stage_ == Stage::kStatus && !sending_due_.status && !status_wanted_) stage_ = Stage::kNothing;
}

// The age is taken when the link is ready for the state, not when it was solved.
void LinkPort::begin_waiting() {
    sending_ = waiting_;
    sending_due_ = waiting_due_;
    waiting_due_ = {};
    sending_.state.age_us = clock_.now_us() - sending_.state.capture_us;
    sending_.state.faults |= link_faults_;
    stage_ = Stage::kHead;
    part_ = 0;
}

void LinkPort::next_part(std::size_t parts, Stage after) {
    if (++part_ < parts) return;
    stage_ = after;
    part_ = 0;
}

bool LinkPort::load_stream_frame() {
    std::array<std::byte, kMaxWirePayloadBytes> payload{};
    Result<std::size_t, WireError> length = std::size_t{0};
    skip_undue_stages();
    MessageType type = MessageType::kWeights;
    switch (stage_) {
        case Stage::kNothing:
            return false;
        case Stage::kHead:
            type = MessageType::kHeadPose;
            length = encode(HeadPoseMessage{sending_.state.sequence, sending_.state.head}, payload);
            next_part(1, Stage::kWeights);
            break;
        case Stage::kWeights:
            length = encode_weights(sending_.state, part_, payload);
            next_part(weights_part_count(sending_.state.shape_count), Stage::kMarkers);
            break;
        case Stage::kMarkers:
            type = MessageType::kMarkers;
            length = encode_markers(sending_.markers, part_, payload);
            next_part(markers_part_count(sending_.markers.marker_count), Stage::kStatus);
            break;
        case Stage::kStatus:
            type = MessageType::kStatus;
            length = encode(health(sending_.health), payload);
            status_wanted_ = false;
            stage_ = Stage::kNothing;
            break;
    }
    RIG_CHECK(length.has_value());
    put_frame(type, ByteSpan(payload).first(*length));
    return true;
}

void LinkPort::finish_frame() {
    frame_bytes_ = frame_sent_ = 0;
    const bool weights_done = sending_due_.weights && stage_ > Stage::kWeights;
    if (!weights_done) return;
    sending_due_.weights = false;
    ++states_sent_;
    if (!sending_.state.held) latencies_.add(clock_.now_us() - sending_.state.capture_us);
}

// The partial frame is lost with the link; what waits stays, and newer states replace it.
void LinkPort::lose_link() {
    if (sending_due_.weights) note_replaced();
    is_up_ = false;
    frame_bytes_ = frame_sent_ = 0;
    stage_ = Stage::kNothing;
    part_ = 0;
    sending_due_ = {};
    retry_us_ = wall_.now_us() + kReopen_us;
}

void LinkPort::reopen_when_due() {
    if (!is_up_ && wall_.now_us() >= retry_us_) static_cast<void>(open());
}

std::size_t LinkPort::read(MutableByteSpan into) {
    if (!is_up_) return 0;
    const auto got = link_.read(into);
    if (!got && got.error() == LinkError::kClosed) lose_link();
    return got.value_or(0);
}

void LinkPort::tell_faults() {
    link_faults_ = raised_;
    raised_ = 0;
    if (!is_up_) link_faults_ |= fault_bit(Fault::kLinkReset);
    if (stalled_) link_faults_ |= fault_bit(Fault::kHostStalled);
    static_cast<void>(link_book_.look(link_faults_));
    const FaultBook::Change change = told_.look(link_faults_ | waiting_.state.faults);
    const FaultMap told = change.raised | change.cleared;
    for (std::uint8_t number = 1; told != 0 && number <= 64; ++number) {
        const FaultMap bit = FaultMap{1} << (number - 1);
        if ((told & bit) == 0) continue;
        EventMessage event;
        event.time_us = clock_.now_us();
        event.kind = (change.raised & bit) != 0 ? EventKind::kFaultRaised : EventKind::kFaultCleared;
        event.level = event.kind == EventKind::kFaultRaised ? EventLevel::kWarning : EventLevel::kInfo;
        event.fault = number;
        event.count = told_.counts()[number - 1U];
        if (bit == fault_bit(Fault::kMarkerDrift) && event.kind == EventKind::kFaultRaised)
            event.text = waiting_.marker_trouble;
        // Streams only go to a host that asked for them; so do events, and they leave room for replies.
        if (streams_.mask == 0 || replies_.size() >= kReplies / 2 || !events_.take(wall_.now_us())) continue;
        static_cast<void>(reply(MessageType::kEvent, event));
    }
}

// A status has no room for names.
void LinkPort::answer_status() {
    request_status();
    if (waiting_.marker_trouble.view().empty()) return;
    EventMessage event;
    event.time_us = clock_.now_us();
    event.kind = EventKind::kLog;
    event.level = EventLevel::kWarning;
    event.text = waiting_.marker_trouble;
    static_cast<void>(reply(MessageType::kEvent, event));
}

// An answer to a command: told whether or not anybody streams.
void LinkPort::tell_neutral() {
    if (waiting_.neutrals_ended == neutrals_told_) return;
    EventMessage event;
    event.time_us = clock_.now_us();
    event.kind = EventKind::kLog;
    event.level = waiting_.neutral_taken ? EventLevel::kInfo : EventLevel::kWarning;
    event.text = waiting_.neutral_text;
    if (reply(MessageType::kEvent, event)) neutrals_told_ = waiting_.neutrals_ended;
}

Health LinkPort::health(const Health& of_solver) const {
    Health health = of_solver;
    health.now_us = clock_.now_us();
    health.frames_sent = states_sent_;
    health.frames_dropped = replaced_.load(std::memory_order_relaxed);
    health.rx_good = static_cast<std::uint32_t>(received_.good);
    health.rx_bad = static_cast<std::uint32_t>(received_.bad());
    if (vitals_.heap_calls_after_seal != nullptr)
        health.heap_calls_after_seal = vitals_.heap_calls_after_seal();
    if (vitals_.peak_memory_kb != nullptr) health.peak_memory_kb = vitals_.peak_memory_kb();
    health.latency = latencies_.spread();
    health.faults |= link_faults_;
    // The solver and the link raise different faults.
    for (std::size_t i = 0; i < health.fault_counts.size(); ++i) {
        health.fault_counts[i] = std::max(health.fault_counts[i], link_book_.counts()[i]);
    }
    return health;
}

}  // namespace rig
