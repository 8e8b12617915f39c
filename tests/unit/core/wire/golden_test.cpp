// PROTOCOL.md and the code say the same: each golden vector of the page is what the code writes for the
// example's values, and decodes to them.
#include <gtest/gtest.h>

#include <map>

#include "core/wire/control_message.hpp"
#include "core/wire/health.hpp"
#include "core/wire/session_messages.hpp"
#include "core/wire/state_messages.hpp"
#include "tests/support/wire/golden_frames.hpp"
#include "tests/support/wire/messages.hpp"

namespace {

using namespace rig;
using Bytes = std::vector<std::byte>;

struct Example {
    MessageType type;
    std::uint8_t source;
    std::uint32_t sequence;
    Bytes payload;
};

Bytes taken(const std::array<std::byte, kMaxWirePayloadBytes>& buffer,
            const Result<std::size_t, WireError>& size) {
    EXPECT_TRUE(size.has_value());
    return Bytes(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size.value_or(0)));
}

template <class Message>
Bytes payload_of(const Message& message) {
    std::array<std::byte, kMaxWirePayloadBytes> buffer;
    return taken(buffer, encode(message, buffer));
}

Hello example_hello() {
    Hello hello;
    hello.role = Role::kBoard;
    hello.pack_loaded = true;
    hello.pack_unsigned = true;
    hello.session_id = 0x12345678;
    hello.capabilities = 7;
    hello.shape_count = 52;
    hello.marker_count = 60;
    hello.rate_mhz = 60000;
    hello.pack_hash = {1, 2, 3, 4, 5, 6, 7, 8};
    hello.firmware = FixedText<24>("0.1.0");
    hello.serial = FixedText<32>("rig-0001");
    hello.board = FixedText<24>("sim");
    return hello;
}

Bytes example_names() {
    std::vector<std::string_view> all(52, "x");
    all[10] = "jawOpen";
    all[11] = "browDown_L";
    all[12] =
        "b\xC3\xA4"
        "cke";
    std::array<std::byte, kMaxWirePayloadBytes> buffer;
    return taken(buffer, encode_names(NameKind::kShapes, all, 10, MutableByteSpan(buffer).first(34)));
}

FaceState example_state() {
    FaceState state;
    state.sequence = 1000;
    state.capture_us = 16666667;
    state.age_us = 8300;
    state.faults = fault_bit(Fault::kMarkersMissing);
    state.slip = {{0.0625F, -0.03125F, 0.0F}, {0.5F, -0.25F, 1.0F}};
    state.cameras = {CameraStatus::kGood, CameraStatus::kMissing, CameraStatus::kUnused,
                     CameraStatus::kUnused};
    state.state = TrackingState::kPartial;
    state.held = false;
    state.shape_count = 3;
    state.weights = {0.0F, 1.0F, -0.25F};
    state.confidence = {1.0F, 128.0F / 255.0F, 0.0F};
    return state;
}

FaceState example_second_part() {
    FaceState state;
    state.sequence = 0xFFFFFFFFU;
    state.capture_us = -1;
    state.age_us = std::int64_t{1} << 40;
    state.faults = FaultMap{1} << 63;
    state.cameras = {CameraStatus::kGone, CameraStatus::kFrozen, CameraStatus::kExposure,
                     CameraStatus::kGood};
    state.state = TrackingState::kHold;
    state.held = true;
    state.shape_count = 193;
    state.weights[191] = 9.0F;  // beyond the range: altered
    state.weights[192] = -2.0F;
    state.confidence[191] = 1.0F / 255.0F;
    state.confidence[192] = 254.0F / 255.0F;
    return state;
}

Bytes weights_payload(const FaceState& state, std::size_t part) {
    std::array<std::byte, kMaxWirePayloadBytes> buffer;
    return taken(buffer, encode_weights(state, part, buffer));
}

Bytes example_markers() {
    MarkerFrame frame;
    frame.sequence = 1000;
    frame.capture_us = 16666667;
    frame.marker_count = 2;
    frame.markers[0] = {true, 2, {10.25F, -20.5F, 30.0F}};
    std::array<std::byte, kMaxWirePayloadBytes> buffer;
    return taken(buffer, encode_markers(frame, 0, buffer));
}

HeadPoseMessage example_head_pose() {
    HeadPoseMessage message;
    message.sequence = 1000;
    message.head.status = HeadStatus::kKnown;
    message.head.capture_us = 16666667;
    message.head.points_used = 118;
    message.head.rotation_rad = {0.0625F, -0.125F, 0.0F};
    message.head.translation_mm = {10.5F, -3.0F, 40.25F};
    message.head.rotation_sigma_rad = {1.0F / 1024.0F, 1.0F / 1024.0F, 1.0F / 512.0F};
    message.head.translation_sigma_mm = {0.25F, 0.25F, 0.5F};
    message.head.rms_px = 0.25F;
    return message;
}

Health example_health() {
    Health health;
    health.now_us = 90000000;
    health.uptime_us = 60000000;
    health.ticks = 3600;
    health.solved = 3590;
    health.held = 10;
    health.overruns = 2;
    health.frames_sent = 3599;
    health.frames_dropped = 1;
    health.rx_good = 120;
    health.rx_bad = 4;
    health.heap_calls_after_seal = 0;
    health.peak_memory_kb = 20480;
    health.temperature_dc = 415;
    health.camera_good = {3598, 3595, 0, 0};
    health.camera_missing = {2, 5, 0, 0};
    health.observations = {61, 58, 0, 0};
    health.markers_seen = 57;
    health.swaps_repaired = 3;
    health.bootstraps = 1;
    health.solve = {2100, 3900, 5200};
    health.latency = {9000, 12000, 21000};
    health.state = TrackingState::kLive;
    health.faults = fault_bit(Fault::kLineNoise);
    health.fault_counts[0] = 5;
    health.fault_counts[20] = 7;
    return health;
}

EventMessage example_event() {
    EventMessage event;
    event.time_us = 2000000;
    event.kind = EventKind::kFaultRaised;
    event.level = EventLevel::kError;
    event.fault = 1;
    event.camera = 1;
    event.count = 3;
    event.text = FixedText<120>("camera 1 is gone");
    return event;
}

ControlMessage example_control() {
    ControlMessage message;
    message.neutral_first = true;
    message.edits.resize(2);
    message.edits[0].value = 2.0F;
    put_in(message.edits[0].shapes, 0);
    put_in(message.edits[0].shapes, 9);
    message.edits[1] = {ControlKind::kCancel, 1.0F, 0.0F, 3, 4, {}};
    return message;
}

std::map<std::string, Example> examples() {
    return {
        {"hello_request", {MessageType::kHelloRequest, 0, 1, {}}},
        {"hello", {MessageType::kHello, 1, 2, payload_of(example_hello())}},
        {"names_request",
         {MessageType::kNamesRequest, 0, 3, payload_of(NamesRequest{NameKind::kMarkers, 40})}},
        {"names", {MessageType::kNames, 1, 4, example_names()}},
        {"time_request", {MessageType::kTimeRequest, 0, 5, payload_of(TimeRequest{1000000})}},
        {"time_reply", {MessageType::kTimeReply, 1, 6, payload_of(TimeReply{1000000, 5000100, 5000150})}},
        {"goodbye", {MessageType::kGoodbye, 1, 7, payload_of(GoodbyeMessage{GoodbyeReason::kShutdown})}},
        {"weights", {MessageType::kWeights, 1, 8, weights_payload(example_state(), 0)}},
        {"weights_second_part", {MessageType::kWeights, 1, 9, weights_payload(example_second_part(), 1)}},
        {"markers", {MessageType::kMarkers, 1, 10, example_markers()}},
        {"status", {MessageType::kStatus, 1, 11, payload_of(example_health())}},
        {"event", {MessageType::kEvent, 1, 12, payload_of(example_event())}},
        {"start_streams", {MessageType::kStartStreams, 0, 13, payload_of(StartStreams{5, 1, 2, 60})}},
        {"stop_streams", {MessageType::kStopStreams, 0, 14, payload_of(StopStreams{7})}},
        {"status_request", {MessageType::kStatusRequest, 0, 15, {}}},
        {"command", {MessageType::kCommand, 0, 16, payload_of(CommandMessage{BoardCommand::kResetTracking})}},
        {"control", {MessageType::kControl, 0, 19, payload_of(example_control())}},
        {"head_pose", {MessageType::kHeadPose, 1, 20, payload_of(example_head_pose())}},
        {"ack", {MessageType::kAck, 1, 17, payload_of(AckMessage{0x20, 13})}},
        {"nak", {MessageType::kNak, 1, 18, payload_of(NakMessage{NakReason::kBadLength, 0x21, 14})}},
    };
}

TEST(Golden, ThePageHasOneVectorPerExample) {
    const auto frames = test::load_golden_frames();
    const auto wanted = examples();
    EXPECT_EQ(frames.size(), wanted.size());
    for (const auto& frame : frames) EXPECT_TRUE(wanted.contains(frame.name)) << frame.name;
}

TEST(Golden, TheCodeWritesThePagesBytes) {
    const auto wanted = examples();
    for (const auto& frame : test::load_golden_frames()) {
        const auto example = wanted.find(frame.name);
        if (example == wanted.end()) continue;
        const Example& e = example->second;
        const Bytes bytes = test::framed({e.type, 0, e.source, e.sequence}, e.payload);
        EXPECT_EQ(bytes, frame.bytes)
            << frame.name << "\n  code: " << test::to_hex(bytes) << "\n  page: " << test::to_hex(frame.bytes);
    }
}

TEST(Golden, TheCodeReadsThePagesBytes) {
    FrameDecoder decoder;
    const Bytes stream = test::golden_stream(test::load_golden_frames());
    ByteSpan rest(stream);
    FrameView frame;
    std::size_t count = 0;
    while (decoder.next(rest, frame)) {
        ++count;
        const Bytes payload(frame.payload.begin(), frame.payload.end());
        const auto again = test::reencoded(frame.head.type, frame.payload);
        ASSERT_TRUE(again.has_value()) << "frame sequence " << frame.head.sequence;
        EXPECT_EQ(*again, payload) << "frame sequence " << frame.head.sequence;
    }
    EXPECT_EQ(count, examples().size());
    EXPECT_EQ(decoder.counters().bad(), 0U);
}

TEST(Golden, DecodedStructsHoldTheExamplesValues) {
    EXPECT_EQ(decode_hello(payload_of(example_hello())).value(), example_hello());
    EXPECT_EQ(decode_status(payload_of(example_health())).value(), example_health());
    EXPECT_EQ(decode_event(payload_of(example_event())).value(), example_event());
    const Bytes names = example_names();
    const auto page = decode_names(names);
    ASSERT_TRUE(page.has_value());
    EXPECT_EQ(page->total, 52);
    EXPECT_EQ(page->first, 10);
    ASSERT_EQ(page->count, 3);
    EXPECT_EQ(page->names[1], "browDown_L");
    const auto part = decode_weights(weights_payload(example_second_part(), 1));
    ASSERT_TRUE(part.has_value());
    EXPECT_TRUE(part->altered);
    EXPECT_EQ(part->state.age_us, 0xFFFFFFFF);
    EXPECT_EQ(part->state.weights[191], kWireWeightHigh);
    EXPECT_EQ(part->state.weights[192], kWireWeightLow);
}

TEST(Golden, EverySingleBitFlipIsRefusedOrDeliveredEqual) {
    for (const auto& golden : test::load_golden_frames()) {
        for (std::size_t bit = 0; bit < golden.bytes.size() * 8; ++bit) {
            Bytes damaged = golden.bytes;
            damaged[bit / 8] ^= static_cast<std::byte>(1 << (bit % 8));
            // An intact frame behind it must arrive whatever happened.
            damaged.insert(damaged.end(), golden.bytes.begin(), golden.bytes.end());
            FrameDecoder decoder;
            ByteSpan rest(damaged);
            FrameView frame;
            std::size_t count = 0;
            while (decoder.next(rest, frame)) {
                ++count;
                const Bytes again = test::framed(frame.head, frame.payload);
                ASSERT_EQ(again, golden.bytes) << golden.name << " bit " << bit;
            }
            ASSERT_GE(count, 1U) << golden.name << " bit " << bit;
        }
    }
}

}  // namespace
