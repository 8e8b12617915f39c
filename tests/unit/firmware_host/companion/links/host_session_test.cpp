// The session against a board that speaks the protocol, over a cable in memory and in simulated time.
#include "firmware_host/companion/links/host_session.hpp"

#include <gtest/gtest.h>

#include "hal/sim/loopback_link.hpp"
#include "tests/support/random.hpp"
#include "tests/support/wire/simulated_board.hpp"

namespace {

using namespace rig;
using namespace rig::host;
using test::BoardOptions;
using test::SimulatedBoard;

constexpr std::int64_t kStep_us = 1000;

struct Bench {
    explicit Bench(const BoardOptions& board_options = {}, SessionOptions options = {},
                   sim::LoopbackKind kind = sim::LoopbackKind::kStream)
        : cable(65536, kind),
          board(cable.far_end(), board_options),
          session(cable.near_end(), options, events()) {
        EXPECT_TRUE(cable.near_end().open().has_value());
        EXPECT_TRUE(cable.far_end().open().has_value());
    }

    SessionEvents events() {
        SessionEvents out;
        out.state = [this](const ReceivedState& received) {
            states.push_back(received.state);
            if (received.latency_us) latencies_us.push_back(*received.latency_us);
        };
        out.markers = [this](const MarkerFrame& frame, std::int64_t) { markers.push_back(frame); };
        out.status = [this](const Health& health) { statuses.push_back(health); };
        out.raw = [this](ByteSpan, std::int64_t) { ++raw; };
        return out;
    }

    void run(double seconds, bool board_lives = true) {
        const std::int64_t end_us = now_us + static_cast<std::int64_t>(seconds * 1.0e6);
        for (; now_us < end_us; now_us += kStep_us) {
            if (board_lives) board.poll(now_us);
            session.poll(now_us);
        }
    }

    std::int64_t now_us = 1'000'000;
    std::vector<FaceState> states;
    std::vector<MarkerFrame> markers;
    std::vector<Health> statuses;
    std::vector<std::int64_t> latencies_us;
    std::uint64_t raw = 0;
    sim::LoopbackPair cable;
    SimulatedBoard board;
    HostSession session;
};

void expect_right_weights(const std::vector<FaceState>& states) {
    for (const FaceState& state : states) {
        for (std::size_t i = 0; i < state.shape_count; ++i) {
            ASSERT_EQ(state.weights[i], SimulatedBoard::weight_of(state.sequence, i));
        }
    }
}

TEST(HostSession, GreetsNamesAndStreams) {
    Bench bench({.shape_count = 256, .marker_count = 128}, {.streams = kAllStreams});
    bench.run(3.0);
    EXPECT_EQ(bench.session.phase(), SessionPhase::kReady);
    ASSERT_TRUE(bench.session.hello().has_value());
    EXPECT_EQ(bench.session.hello()->serial.view(), "test-rig");
    ASSERT_EQ(bench.session.shape_names().size(), 256U);
    EXPECT_EQ(bench.session.shape_names()[255], "shape_255");
    ASSERT_EQ(bench.session.marker_names().size(), 128U);
    EXPECT_EQ(bench.session.marker_names()[127], "marker_127");
    EXPECT_GT(bench.states.size(), 170U);
    expect_right_weights(bench.states);
    EXPECT_EQ(bench.session.counters().states_missing, 0U);
    EXPECT_EQ(bench.session.counters().frames_lost, 0U);
    EXPECT_EQ(bench.session.frames().bad(), 0U);
    ASSERT_GT(bench.markers.size(), 170U);
    EXPECT_TRUE(bench.markers[5].markers[126].seen);
    EXPECT_FALSE(bench.markers[5].markers[127].seen);
    EXPECT_GE(bench.statuses.size(), 2U);
    EXPECT_EQ(bench.raw, bench.session.frames().good);
}

TEST(HostSession, StatesHoldTheHeadOfTheirOwnTick) {
    for (const std::uint32_t lose_every : {0U, 7U}) {
        Bench bench({.lose_every = lose_every, .tells_head = true},
                    {.streams = kStreamWeights | kStreamHead});
        bench.run(4.0);
        EXPECT_TRUE(bench.session.tells_head());
        std::size_t known = 0;
        std::size_t without = 0;
        ASSERT_GT(bench.states.size(), 60U);
        for (const FaceState& state : bench.states) {
            if (state.head.status == HeadStatus::kUnknown) {
                ++without;  // its head was lost on the line, and no other tick's stands in for it
                EXPECT_EQ(state.head.capture_us, 0);
                continue;
            }
            EXPECT_EQ(state.head.status, state.sequence % 4 == 3 ? HeadStatus::kTooFew : HeadStatus::kKnown);
            EXPECT_EQ(state.head.capture_us, state.capture_us);
            if (state.head.status != HeadStatus::kKnown) continue;
            ++known;
            EXPECT_EQ(state.head.translation_mm[0], static_cast<float>(state.sequence));
        }
        EXPECT_GT(known, bench.states.size() / 2);
        EXPECT_EQ(without > 0, lose_every > 0);
        EXPECT_EQ(bench.session.counters().unknown, 0U);
    }
}

TEST(HostSession, ABoardThatKnowsNoHeadIsNotAskedForIt) {
    Bench bench({}, {.streams = kStreamWeights | kStreamHead});
    bench.run(1.0);
    EXPECT_EQ(bench.session.phase(), SessionPhase::kReady) << bench.session.refusal();
    EXPECT_FALSE(bench.session.tells_head());
    ASSERT_FALSE(bench.states.empty());
    EXPECT_EQ(bench.states.back().head.status, HeadStatus::kUnknown);
}

TEST(HostSession, MeasuresLatencyThroughTheOffsetOfTheClocks) {
    for (const std::int64_t ahead_us :
         {std::int64_t{0}, std::int64_t{3'600'000'000}, std::int64_t{-900'000}}) {
        Bench bench({.clock_ahead_us = ahead_us, .capture_delay_us = 8000});
        bench.run(2.0);
        ASSERT_FALSE(bench.latencies_us.empty());
        for (const std::int64_t latency_us : bench.latencies_us) {
            EXPECT_GE(latency_us, 8000 - kStep_us);
            EXPECT_LE(latency_us, 8000 + 2 * kStep_us);
        }
        EXPECT_NEAR(static_cast<double>(bench.session.time_sync().offset_us()), static_cast<double>(ahead_us),
                    kStep_us);
    }
}

TEST(HostSession, CountsWhatIsLost) {
    Bench bench({.lose_every = 37});
    bench.run(10.0);
    EXPECT_EQ(bench.session.phase(), SessionPhase::kReady);
    EXPECT_GT(bench.session.counters().states_missing, 5U);
    EXPECT_NEAR(static_cast<double>(bench.session.counters().frames_lost),
                static_cast<double>(bench.board.lost()), 2.0);
    const std::uint32_t span = bench.states.back().sequence - bench.states.front().sequence + 1;
    EXPECT_EQ(bench.states.size() + bench.session.counters().states_missing, span);
    expect_right_weights(bench.states);
}

TEST(HostSession, DividersAreNotLoss) {
    Bench bench({}, {.weights_divider = 4});
    bench.run(3.0);
    EXPECT_GT(bench.states.size(), 40U);
    EXPECT_LT(bench.states.size(), 50U);
    EXPECT_EQ(bench.session.counters().states_missing, 0U);
}

TEST(HostSession, LooksWithoutOwning) {
    Bench bench({}, {.streams = 0});
    bench.session.request_status();
    bench.run(5.0);
    EXPECT_EQ(bench.session.phase(), SessionPhase::kReady);
    EXPECT_EQ(bench.session.shape_names().size(), 5U);
    EXPECT_EQ(bench.statuses.size(), 1U);
    EXPECT_TRUE(bench.states.empty());
    EXPECT_FALSE(bench.board.streams_weights());
}

TEST(HostSession, ComesBackAfterTheCableWasPulled) {
    Bench bench;
    bench.run(2.0);
    const std::size_t before = bench.states.size();
    bench.cable.unplug();
    bench.run(1.0);
    EXPECT_EQ(bench.session.phase(), SessionPhase::kClosed);
    EXPECT_EQ(bench.session.counters().links_lost, 1U);
    EXPECT_EQ(bench.states.size(), before);
    bench.cable.plug_in();
    ASSERT_TRUE(bench.cable.far_end().open().has_value());
    bench.run(2.0);
    EXPECT_EQ(bench.session.phase(), SessionPhase::kReady);
    EXPECT_GT(bench.states.size(), before + 60);
    EXPECT_GT(bench.session.counters().states_missing, 50U) << "the sequence went on: the gap shows";
    EXPECT_EQ(bench.session.counters().restarts, 0U);
}

TEST(HostSession, FollowsARestartedBoard) {
    Bench bench;
    bench.run(3.0);
    bench.board.restart(0x5EC0D);
    bench.run(6.0);
    EXPECT_EQ(bench.session.counters().restarts, 1U);
    EXPECT_EQ(bench.session.phase(), SessionPhase::kReady);
    ASSERT_TRUE(bench.session.hello().has_value());
    EXPECT_EQ(bench.session.hello()->session_id, 0x5EC0DU);
    EXPECT_EQ(bench.session.shape_names().size(), 5U);
    EXPECT_LT(bench.states.back().sequence, 400U);
    EXPECT_GT(bench.states.size(), 300U);
    expect_right_weights(bench.states);
}

TEST(HostSession, AsksAgainAfterSilenceAndGoodbye) {
    Bench bench;
    bench.run(2.0);
    bench.board.mute(true);
    bench.run(4.0);
    EXPECT_EQ(bench.session.phase(), SessionPhase::kGreeting);
    bench.board.mute(false);
    bench.run(2.0);
    EXPECT_EQ(bench.session.phase(), SessionPhase::kReady);
    bench.board.say_goodbye();
    bench.run(0.002, false);
    EXPECT_EQ(bench.session.phase(), SessionPhase::kGreeting);
    bench.run(2.0);
    EXPECT_EQ(bench.session.phase(), SessionPhase::kReady);
    EXPECT_TRUE(bench.board.streams_weights());
}

TEST(HostSession, ARefusalIsToldAndTriedAgain) {
    Bench bench({.busy = true});
    bench.run(2.0);
    EXPECT_EQ(bench.session.phase(), SessionPhase::kRefused);
    EXPECT_NE(bench.session.refusal().find("another host"), std::string::npos);
    EXPECT_TRUE(bench.states.empty());
    bench.board.set_busy(false);
    bench.run(3.0);
    EXPECT_EQ(bench.session.phase(), SessionPhase::kReady);
    EXPECT_TRUE(bench.session.refusal().empty());
    EXPECT_FALSE(bench.states.empty());
}

ControlMessage offset_of(float value) {
    ControlMessage message;
    message.edits.resize(1);
    message.edits[0] = {ControlKind::kOffset, value, 0.0F, 0, 0, {}};
    return message;
}

TEST(HostSession, ControlsArriveInOrderThroughLoss) {
    // Names and all, without owning the session.
    Bench bench({.lose_every = 3}, {.streams = 0});
    for (int i = 0; i < 20; ++i) bench.session.control(offset_of(0.25F * static_cast<float>(i)));
    bench.run(15.0);
    EXPECT_EQ(bench.session.controls_waiting(), 0U);
    EXPECT_FALSE(bench.session.control_refusal().has_value());
    std::vector<float> arrived;
    for (const ControlMessage& message : bench.board.controls()) {
        const float value = message.edits[0].value;
        if (arrived.empty() || arrived.back() != value) arrived.push_back(value);  // repeated: same again
    }
    ASSERT_EQ(arrived.size(), 20U);
    for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(arrived[i], 0.25F * static_cast<float>(i));
}

TEST(HostSession, ARefusedControlIsToldAndNotRepeated) {
    Bench bench({.busy = true}, {.streams = 0});
    bench.session.control(offset_of(0.5F));
    bench.session.control(offset_of(0.75F));
    bench.run(3.0);
    EXPECT_EQ(bench.session.control_refusal(), NakReason::kBusy);
    EXPECT_EQ(bench.session.controls_waiting(), 0U);
    EXPECT_TRUE(bench.board.controls().empty());
}

TEST(HostSession, CommandsGoOnce) {
    Bench bench;
    bench.run(1.0);
    bench.session.command(BoardCommand::kResetTracking);
    EXPECT_FALSE(bench.session.command_answered());
    bench.run(2.0);
    EXPECT_EQ(bench.board.commands(), 1U);
    EXPECT_TRUE(bench.session.command_answered());
    EXPECT_FALSE(bench.session.command_refusal().has_value());
}

TEST(HostSession, ARefusedCommandSaysWhy) {
    Bench bench({.busy = true}, {.streams = 0});
    bench.run(1.0);
    bench.session.command(BoardCommand::kNeutral);
    bench.run(1.0);
    EXPECT_TRUE(bench.session.command_answered());
    EXPECT_EQ(bench.session.command_refusal(), NakReason::kBusy);
}

TEST(HostSession, LeavingStopsTheStreams) {
    Bench bench;
    bench.run(1.0);
    EXPECT_TRUE(bench.board.streams_weights());
    bench.session.leave();
    bench.board.poll(bench.now_us);
    EXPECT_FALSE(bench.board.streams_weights());
    EXPECT_EQ(bench.board.goodbyes(), 1U);
}

TEST(HostSession, DatagramsToo) {
    Bench bench({.shape_count = 200}, {.streams = kAllStreams}, sim::LoopbackKind::kDatagram);
    bench.run(2.0);
    EXPECT_EQ(bench.session.phase(), SessionPhase::kReady);
    EXPECT_GT(bench.states.size(), 100U);
    expect_right_weights(bench.states);
}

TEST(HostSession, ABoardWithoutShapesIsReadyToo) {
    Bench bench({.shape_count = 0, .marker_count = 0});
    bench.run(2.0);
    EXPECT_EQ(bench.session.phase(), SessionPhase::kReady);
    EXPECT_GT(bench.states.size(), 100U);
}

TEST(HostSession, NoiseOnTheLineEndsInCounters) {
    sim::LoopbackPair cable(65536, sim::LoopbackKind::kStream);
    ASSERT_TRUE(cable.near_end().open().has_value());
    ASSERT_TRUE(cable.far_end().open().has_value());
    HostSession session(cable.near_end(), {}, {});
    test::SeededRandom random(5);
    std::array<std::byte, 512> noise;
    std::array<std::byte, 65536> ignored;
    for (std::int64_t now_us = 0; now_us < 2'000'000; now_us += kStep_us) {
        for (std::byte& byte : noise) byte = static_cast<std::byte>(random.bits());
        (void)cable.far_end().write(noise);
        (void)cable.far_end().read(ignored);
        session.poll(now_us);
    }
    EXPECT_EQ(session.phase(), SessionPhase::kGreeting);
    EXPECT_EQ(session.frames().good, 0U);
    EXPECT_GT(session.frames().bad(), 1000U);
}

}  // namespace
