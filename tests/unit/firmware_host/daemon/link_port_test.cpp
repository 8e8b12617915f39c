// The port against a link that takes what it likes: every split of the stream, every place to stop.
#include "firmware_host/daemon/link_port.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "hal/sim/manual_clock.hpp"

namespace rig::test {
namespace {

// Takes at most `budget` bytes in all, `at_once` in a call.
class MiserlyLink final : public ByteLink {
  public:
    Result<void, LinkError> open() override {
        closed = false;
        ++opened;
        return {};
    }
    void close() override { closed = true; }
    Result<std::size_t, LinkError> write(ByteSpan bytes) override {
        if (closed) return failure(LinkError::kClosed);
        const std::size_t taken = std::min({bytes.size(), budget, at_once});
        budget -= taken;
        received.insert(received.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(taken));
        return taken;
    }
    Result<std::size_t, LinkError> read(MutableByteSpan) override {
        if (closed) return failure(LinkError::kClosed);
        return std::size_t{0};
    }
    bool is_datagram() const override { return false; }

    std::vector<std::byte> received;
    std::size_t budget = 0;
    std::size_t at_once = ~std::size_t{0};
    bool closed = false;
    int opened = 0;
};

TickOutput output(std::uint32_t sequence, std::uint16_t shapes, std::int64_t capture_us) {
    TickOutput result;
    result.state.sequence = sequence;
    result.state.capture_us = capture_us;
    result.state.shape_count = shapes;
    for (std::size_t i = 0; i < shapes; ++i) result.state.weights[i] = 0.25F;
    return result;
}

struct Decoded {
    std::vector<FaceState> states;
    std::vector<MessageType> types;
    FrameCounters counters;
    AssemblyCounters assembly;
};

Decoded decode(const std::vector<std::byte>& bytes) {
    Decoded result;
    FrameDecoder decoder;
    StateAssembler assembler;
    ByteSpan chunk(bytes);
    FrameView frame;
    while (decoder.next(chunk, frame)) {
        result.types.push_back(frame.head.type);
        if (frame.head.type != MessageType::kWeights) continue;
        const auto part = decode_weights(frame.payload);
        EXPECT_TRUE(part.has_value());
        if (part && assembler.push(*part)) result.states.push_back(assembler.state());
    }
    result.counters = decoder.counters();
    result.assembly = assembler.counters();
    return result;
}

class LinkPortTest : public testing::Test {
  protected:
    sim::ManualClock clock_{1'000'000};
    sim::ManualClock wall_;
    MiserlyLink link_;
    LinkPort port_{link_, clock_, wall_, Vitals{}};

    void start(std::uint8_t mask, std::uint16_t divider = 1) {
        port_.adopt();
        port_.start_streams(StartStreams{mask, divider, divider, divider});
    }
};

// The host stops at every byte offset of two states of two parts each; five more ticks pass; it reads on.
TEST_F(LinkPortTest, StoppingAnywhereNeverInterleavesAndKeepsTheNewest) {
    for (std::size_t stop = 0; stop < 2600; ++stop) {
        MiserlyLink link;
        LinkPort port(link, clock_, wall_, Vitals{});
        port.adopt();
        port.start_streams(StartStreams{kStreamWeights, 1, 1, 1});
        link.budget = stop;
        for (std::uint32_t tick = 0; tick < 7; ++tick) {
            port.offer(output(tick, kMaxShapes, clock_.now_us()));
            port.pump_out();
        }
        link.budget = 100'000;
        port.pump_out();
        EXPECT_TRUE(port.drained());
        const Decoded got = decode(link.received);
        ASSERT_EQ(got.counters.bad(), 0U) << stop;
        ASSERT_EQ(got.assembly.abandoned, 0U) << stop;
        ASSERT_FALSE(got.states.empty());
        EXPECT_EQ(got.states.back().sequence, 6U);
        for (std::size_t i = 1; i < got.states.size(); ++i) {
            ASSERT_GT(got.states[i].sequence, got.states[i - 1].sequence);
        }
        const Health health = port.health(Health{});
        EXPECT_EQ(health.frames_sent, got.states.size());
        EXPECT_EQ(health.frames_sent + health.frames_dropped, 7U);
    }
}

TEST_F(LinkPortTest, TheAgeIsThatOfTheMomentOfSending) {
    start(kStreamWeights);
    const std::int64_t capture_us = clock_.now_us();
    port_.offer(output(0, 3, capture_us));
    clock_.advance_by_us(12'345);
    link_.budget = 1000;
    port_.pump_out();
    EXPECT_EQ(decode(link_.received).states.at(0).age_us, 12'345);
}

TEST_F(LinkPortTest, RepliesWaitForTheFrameAndTheStateNotMore) {
    start(kStreamWeights);
    link_.budget = 100;  // inside the first part
    port_.offer(output(0, kMaxShapes, 0));
    port_.pump_out();
    EXPECT_TRUE(port_.reply(MessageType::kAck, AckMessage{1, 2}));
    port_.offer(output(1, kMaxShapes, 0));
    link_.budget = 100'000;
    port_.pump_out();
    const std::vector<MessageType> wanted{MessageType::kWeights, MessageType::kWeights, MessageType::kAck,
                                          MessageType::kWeights, MessageType::kWeights};
    EXPECT_EQ(decode(link_.received).types, wanted);
}

TEST_F(LinkPortTest, AFullReplyQueueRefuses) {
    start(kStreamWeights);
    int taken = 0;
    while (taken < 100 && port_.reply(MessageType::kAck, AckMessage{})) ++taken;
    EXPECT_GE(taken, 8);
    EXPECT_LT(taken, 100);
    link_.budget = 100'000;
    port_.pump_out();
    EXPECT_EQ(decode(link_.received).types.size(), static_cast<std::size_t>(taken));
}

TEST_F(LinkPortTest, DividersThin) {
    start(kStreamWeights, 3);
    link_.budget = 1'000'000;
    for (std::uint32_t tick = 0; tick < 10; ++tick) {
        port_.offer(output(tick, 3, 0));
        port_.pump_out();
    }
    std::vector<std::uint32_t> sequences;
    for (const FaceState& state : decode(link_.received).states) sequences.push_back(state.sequence);
    EXPECT_EQ(sequences, (std::vector<std::uint32_t>{0, 3, 6, 9}));
}

TEST_F(LinkPortTest, TheHeadGoesBeforeTheWeightsOfItsTickAndOnlyWithThem) {
    start(kStreamWeights | kStreamHead, 2);
    link_.budget = 1'000'000;
    for (std::uint32_t tick = 0; tick < 4; ++tick) {
        port_.offer(output(tick, 3, 0));
        port_.pump_out();
    }
    port_.stop_streams(kStreamWeights);
    port_.offer(output(4, 3, 0));
    port_.pump_out();
    EXPECT_EQ(decode(link_.received).types,
              (std::vector<MessageType>{MessageType::kHeadPose, MessageType::kWeights, MessageType::kHeadPose,
                                        MessageType::kWeights}));
    EXPECT_EQ(port_.health(Health{}).frames_sent, 2U);
    FrameDecoder decoder;
    ByteSpan chunk(link_.received);
    FrameView frame;
    for (const std::uint32_t tick : {0U, 2U}) {
        ASSERT_TRUE(decoder.next(chunk, frame));
        const auto head = decode_head_pose(frame.payload);
        ASSERT_TRUE(head.has_value());
        EXPECT_EQ(head->sequence, tick);
        ASSERT_TRUE(decoder.next(chunk, frame));
    }
}

TEST_F(LinkPortTest, AReplacedTickHandsOnWhatItOwed) {
    start(kStreamWeights);
    port_.start_streams(StartStreams{kStreamStatus, 1, 1, 5});
    port_.offer(output(0, 3, 0));  // owes a status
    port_.offer(output(1, 3, 0));
    link_.budget = 100'000;
    port_.pump_out();
    const std::vector<MessageType> wanted{MessageType::kWeights, MessageType::kStatus};
    EXPECT_EQ(decode(link_.received).types, wanted);
}

TEST_F(LinkPortTest, ALostLinkIsOpenedAgainAndStartsWithAWholeFrame) {
    start(kStreamWeights);
    link_.budget = 30;
    port_.offer(output(0, 20, 0));
    port_.pump_out();
    link_.closed = true;
    port_.pump_out();
    link_.received.clear();
    link_.budget = 100'000;
    port_.offer(output(1, 20, 0));
    port_.pump_out();
    EXPECT_TRUE(link_.received.empty());  // not yet time to try again
    wall_.advance_by_us(60'000);
    port_.pump_out();
    EXPECT_EQ(link_.opened, 1);
    const Decoded got = decode(link_.received);
    ASSERT_EQ(got.states.size(), 1U);
    EXPECT_EQ(got.states[0].sequence, 1U);
    EXPECT_EQ(got.counters.bad(), 0U);
}

TEST_F(LinkPortTest, StatusIsAnsweredBeforeTheFirstTick) {
    port_.adopt();
    link_.budget = 100'000;
    port_.request_status();
    port_.pump_out();
    EXPECT_EQ(decode(link_.received).types, std::vector<MessageType>{MessageType::kStatus});
    EXPECT_TRUE(port_.drained());
}

}  // namespace
}  // namespace rig::test
