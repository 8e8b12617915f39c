// What a board answers, message by message, without a pack and without cameras.
#include "firmware_host/daemon/control.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "hal/sim/loopback_link.hpp"
#include "hal/sim/manual_clock.hpp"

namespace rig::test {
namespace {

struct Answer {
    MessageType type = MessageType::kAck;
    std::vector<std::byte> payload;
};

class ControlTest : public testing::Test {
  protected:
    ControlTest() {
        EXPECT_TRUE(pair_.near_end().open().has_value());
        EXPECT_TRUE(pair_.far_end().open().has_value());
        port_.adopt();
    }

    Control& board(std::uint32_t capabilities, StartStreams first = {.mask = 0}) {
        BoardIdentity identity;
        identity.hello.role = Role::kBoard;
        identity.hello.capabilities = capabilities;
        identity.first_streams = first;
        control_ = std::make_unique<Control>(port_, solver_, clock_, wall_, identity);
        return *control_;
    }

    void send(MessageType type, ByteSpan payload) {
        std::array<std::byte, kMaxWireFrameBytes> frame{};
        FrameHead head;
        head.type = type;
        head.sequence = sequence_++;
        const auto length = encode_frame(head, payload, frame);
        ASSERT_TRUE(length.has_value());
        ASSERT_EQ(pair_.far_end().write(ByteSpan(frame).first(*length)).value_or(0), *length);
        control_->service();
        port_.pump_out();
    }

    template <class Message>
    void send(MessageType type, const Message& message) {
        std::array<std::byte, kMaxWirePayloadBytes> payload{};
        const auto length = encode(message, payload);
        ASSERT_TRUE(length.has_value());
        send(type, ByteSpan(payload).first(*length));
    }

    std::vector<Answer> answers() {
        std::vector<Answer> all;
        std::array<std::byte, 4096> bytes{};
        while (const std::size_t got = pair_.far_end().read(bytes).value_or(0)) {
            ByteSpan chunk = ByteSpan(bytes).first(got);
            FrameView frame;
            while (decoder_.next(chunk, frame))
                all.push_back({frame.head.type, {frame.payload.begin(), frame.payload.end()}});
        }
        return all;
    }

    sim::ManualClock clock_{1'000'000};
    sim::ManualClock wall_;
    sim::LoopbackPair pair_{1 << 16, sim::LoopbackKind::kStream};
    LinkPort port_{pair_.near_end(), clock_, wall_, Vitals{}};
    std::unique_ptr<Pipeline> pipeline_ = std::make_unique<Pipeline>();
    TickSolver solver_{TickSolverParts{.pipeline = *pipeline_, .wall = wall_}};
    std::unique_ptr<Control> control_;
    FrameDecoder decoder_;
    std::uint32_t sequence_ = 0;
};

constexpr std::uint8_t kWithHead = kAllStreams | kStreamHead;

TEST_F(ControlTest, AHeadStreamIsRefusedWhereThereIsNone) {
    board(kCanStreamMarkers);
    send(MessageType::kStartStreams, StartStreams{.mask = kWithHead});
    const auto said = answers();
    ASSERT_EQ(said.size(), 1U);
    ASSERT_EQ(said[0].type, MessageType::kNak);
    EXPECT_EQ(decode_nak(said[0].payload).value().reason, NakReason::kBadValue);
    EXPECT_EQ(port_.streams(), 0) << "all of a message or nothing";
    EXPECT_FALSE(control_->has_owner());
}

TEST_F(ControlTest, AHeadStreamEndsWithItsSession) {
    board(kCanStreamMarkers | kCanStreamHead);
    send(MessageType::kStartStreams, StartStreams{.mask = kWithHead});
    ASSERT_EQ(answers().at(0).type, MessageType::kAck);
    EXPECT_EQ(port_.streams(), kWithHead);
    send(MessageType::kGoodbye, GoodbyeMessage{});
    EXPECT_EQ(port_.streams(), 0);
    EXPECT_FALSE(control_->has_owner());
}

TEST_F(ControlTest, AfterASessionTheFirstStreamsRunAgain) {
    board(kCanStreamMarkers | kCanStreamHead, StartStreams{.mask = kStreamWeights});
    EXPECT_EQ(port_.streams(), kStreamWeights);
    send(MessageType::kStartStreams, StartStreams{.mask = kWithHead});
    send(MessageType::kGoodbye, GoodbyeMessage{});
    EXPECT_EQ(port_.streams(), kStreamWeights);
}

TEST_F(ControlTest, MarkersInTroubleAreToldBeforeTheStatusThatWasAskedFor) {
    board(kCanStreamMarkers);
    send(MessageType::kStatusRequest, ByteSpan{});
    const auto well = answers();
    ASSERT_EQ(well.size(), 1U);
    EXPECT_EQ(well[0].type, MessageType::kStatus);

    auto output = std::make_unique<TickOutput>();
    output->state.sequence = 1;
    output->marker_trouble = FixedText<120>("marker LL_M has come off");
    port_.offer(*output);
    send(MessageType::kStatusRequest, ByteSpan{});
    const auto said = answers();
    ASSERT_EQ(said.size(), 2U);
    ASSERT_EQ(said[0].type, MessageType::kEvent);
    const EventMessage event = decode_event(said[0].payload).value();
    EXPECT_EQ(event.kind, EventKind::kLog);
    EXPECT_EQ(event.text.view(), "marker LL_M has come off");
    EXPECT_EQ(said[1].type, MessageType::kStatus);
}

TEST_F(ControlTest, TheFaultOfAMarkerNamesIt) {
    board(kCanStreamMarkers);
    send(MessageType::kStartStreams, StartStreams{.mask = kStreamMarkers});
    static_cast<void>(answers());
    auto output = std::make_unique<TickOutput>();
    output->state.sequence = 1;
    output->state.faults = fault_bit(Fault::kMarkerDrift);
    output->marker_trouble = FixedText<120>("marker MC_L has slid by 2.1 mm");
    port_.offer(*output);
    port_.pump_out();
    const auto said = answers();
    const auto event = std::ranges::find(said, MessageType::kEvent, &Answer::type);
    ASSERT_NE(event, said.end());
    const EventMessage raised = decode_event(event->payload).value();
    EXPECT_EQ(raised.fault, static_cast<std::uint8_t>(Fault::kMarkerDrift));
    EXPECT_EQ(raised.text.view(), "marker MC_L has slid by 2.1 mm");
}

}  // namespace
}  // namespace rig::test
