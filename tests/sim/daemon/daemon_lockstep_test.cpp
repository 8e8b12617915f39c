// The daemon in simulated time: what the output contract promises, whatever cameras, link and host do.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <set>

#include "core/wire/control_message.hpp"
#include "tests/sim/daemon/daemon_bench.hpp"
#include "tests/sim/daemon/painted_take.hpp"
#include "tests/support/random.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::test {
namespace {

using sim::FaultKind;

constexpr std::int64_t kFrame_us = 16'667;

ControlMessage control_of(ControlKind kind, std::initializer_list<std::size_t> shapes, float value,
                          float high = 0.0F) {
    ControlMessage message;
    ControlEdit edit{kind, value, high, 0, 0, {}};
    for (const std::size_t shape : shapes) put_in(edit.shapes, shape);
    static_cast<void>(message.edits.push_back(edit));
    return message;
}

sim::FaultEvent fault(FaultKind what, int from_frame, int frames, std::uint8_t target,
                      double magnitude = 0.0) {
    return {(from_frame + 1) * kFrame_us - 100, what, frames * kFrame_us, target, magnitude};
}

TEST(DaemonLockstep, EveryTickReachesAHostThatReads) {
    DaemonBench bench;
    EXPECT_EQ(bench.run(), AppEnd::kWorldEnded);
    ASSERT_EQ(bench.host.states.size(), 60U);
    for (std::size_t i = 0; i < 60; ++i) EXPECT_EQ(bench.host.states[i].sequence, i);
    EXPECT_EQ(bench.host.counters().bad(), 0U);
    EXPECT_EQ(bench.host.count(MessageType::kMarkers), 60U);
    const Health status = bench.host.last_status();
    EXPECT_EQ(status.ticks, 60U);
    EXPECT_EQ(status.frames_sent, 60U);
    EXPECT_EQ(status.frames_dropped, 0U);
    EXPECT_EQ(status.camera_good[0], 60U);
    EXPECT_EQ(status.camera_good[1], 60U);
    EXPECT_EQ(bench.host.frames.back().first.type, MessageType::kGoodbye);
    EXPECT_GT(status.solved, 50U);
    EXPECT_EQ(bench.host.states.back().state, TrackingState::kLive);
    EXPECT_TRUE(bench.led.level());
    EXPECT_FALSE(bench.watchdog.expired());
}

TEST(DaemonLockstep, TwoRunsHaveOneDigest) {
    DaemonBench first;
    DaemonBench second;
    // Another host makes no difference to what is solved.
    second.host_acts = [](DaemonBench& bench) { bench.host.read(97); };
    static_cast<void>(first.run());
    static_cast<void>(second.run());
    EXPECT_EQ(first.app().digest().ticks(), 60U);
    EXPECT_EQ(first.app().digest().value(), second.app().digest().value());
    BenchOptions shorter;
    shorter.frames = 59;
    DaemonBench third(shorter);
    static_cast<void>(third.run());
    EXPECT_NE(first.app().digest().value(), third.app().digest().value());
}

TEST(DaemonLockstep, AHostThatNeverReadsCostsItsPatienceOnce) {
    BenchOptions options;
    options.link_capacity = 4096;
    DaemonBench bench(options);
    bench.host_acts = [](DaemonBench&) {};
    EXPECT_EQ(bench.run(), AppEnd::kWorldEnded);
    const Health health = bench.app().health();
    EXPECT_EQ(health.ticks, 60U);
    EXPECT_GT(health.frames_dropped, 30U);
    EXPECT_EQ(health.frames_sent + health.frames_dropped + 2, 60U);  // one is under way for ever, one waits
    EXPECT_LT(bench.wall.now_us(), 60 * kFrame_us + 2'000'000 + 1'000'000 + 1'000);
    EXPECT_EQ(health.fault_counts[static_cast<std::size_t>(Fault::kHostStalled) - 1], 1);
    DaemonBench reading;
    static_cast<void>(reading.run());
    EXPECT_EQ(bench.app().digest().value(), reading.app().digest().value());
}

TEST(DaemonLockstep, AHostThatReadsAgainGetsFreshWholeFrames) {
    BenchOptions options;
    options.link_capacity = 3000;
    options.frames = 90;
    DaemonBench bench(options);
    std::size_t states_before = 0;
    bench.host_acts = [&](DaemonBench& b) {
        const bool asleep = b.ticks_done() >= 30 && b.ticks_done() < 60;
        if (asleep) states_before = b.host.states.size();
        if (!asleep) b.host.read();
    };
    static_cast<void>(bench.run());
    EXPECT_EQ(bench.host.counters().bad(), 0U);
    ASSERT_GT(bench.host.states.size(), states_before + 20);
    std::uint32_t last = 0;
    std::int64_t oldest_us = 0;
    for (const FaceState& state : bench.host.states) {
        EXPECT_TRUE(state.sequence == 0 || state.sequence > last);
        last = state.sequence;
        oldest_us = std::max(oldest_us, state.age_us);
    }
    EXPECT_EQ(last, 89U);
    EXPECT_LE(oldest_us, 2 * kFrame_us);  // age is taken when the link takes the frame
    EXPECT_GT(bench.app().health().frames_dropped, 20U);
}

TEST(DaemonLockstep, ASlowHostLosesNothing) {
    DaemonBench bench;
    bench.host_acts = [](DaemonBench& b) { b.host.read(50); };
    static_cast<void>(bench.run());
    bench.host.read();
    EXPECT_EQ(bench.host.states.size(), 60U);
    EXPECT_EQ(bench.app().health().frames_dropped, 0U);
    EXPECT_EQ(bench.host.counters().bad(), 0U);
}

TEST(DaemonLockstep, ALinkResetIsSurvived) {
    BenchOptions options;
    options.frames = 120;
    options.faults.events = {fault(FaultKind::kLinkReset, 40, 20, 0)};
    DaemonBench bench(options);
    static_cast<void>(bench.run());
    std::set<std::uint32_t> got;
    for (const FaceState& state : bench.host.states) got.insert(state.sequence);
    EXPECT_EQ(got.count(39), 1U);
    EXPECT_EQ(got.count(50), 0U);
    EXPECT_EQ(got.count(119), 1U);
    // Back within 250 ms, which are 15 frames, of the port's return.
    EXPECT_EQ(got.count(60 + 15), 1U);
    EXPECT_EQ(bench.host.last_status().fault_counts[static_cast<std::size_t>(Fault::kLinkReset) - 1], 1);
    EXPECT_EQ(bench.host.last_status().ticks, 120U);
}

TEST(DaemonLockstep, ALineOfPartialWritesCarriesEverything) {
    BenchOptions options;
    options.faults.events = {fault(FaultKind::kLinkPartial, 0, 60, 0, 13.0)};
    DaemonBench bench(options);
    static_cast<void>(bench.run());
    EXPECT_EQ(bench.host.states.size(), 60U);
    EXPECT_EQ(bench.host.counters().bad(), 0U);
}

TEST(DaemonLockstep, OneCameraGoneIsPartialAndComesBack) {
    BenchOptions options;
    options.frames = 200;
    options.faults.events = {fault(FaultKind::kCameraGone, 60, 30, 1)};
    DaemonBench bench(options);
    static_cast<void>(bench.run());
    ASSERT_EQ(bench.host.states.size(), 200U);
    EXPECT_EQ(bench.host.states[55].state, TrackingState::kLive);
    EXPECT_EQ(bench.host.states[70].cameras[1], CameraStatus::kGone);
    EXPECT_EQ(bench.host.states[70].cameras[0], CameraStatus::kGood);
    EXPECT_NE(bench.host.states[70].faults & fault_bit(Fault::kCameraGone), 0U);
    EXPECT_EQ(bench.host.states[70].state, TrackingState::kPartial);
    // Back-off has tried at 0.25 s and again at 0.75 s: within a second of the return.
    EXPECT_EQ(bench.host.states[150].cameras[1], CameraStatus::kGood);
    EXPECT_EQ(bench.host.states[199].state, TrackingState::kLive);
}

TEST(DaemonLockstep, WithoutAnyCameraTicksGoOn) {
    BenchOptions options;
    options.frames = 200;
    options.faults.events = {fault(FaultKind::kCameraGone, 60, 40, 0),
                             fault(FaultKind::kCameraGone, 60, 40, 1)};
    DaemonBench bench(options);
    static_cast<void>(bench.run());
    bool held = false;
    bool lost = false;
    std::int64_t last_age_us = 0;
    for (const FaceState& state : bench.host.states) {
        if (state.state == TrackingState::kHold) held = true;
        if (state.state == TrackingState::kLost) lost = true;
        if (state.held && held && !lost) {
            EXPECT_GE(state.age_us, last_age_us);
        }
        last_age_us = state.held ? state.age_us : 0;
        for (std::size_t i = 0; i < state.shape_count; ++i) ASSERT_TRUE(std::isfinite(state.weights[i]));
    }
    EXPECT_TRUE(held);
    EXPECT_TRUE(lost);
    EXPECT_EQ(bench.host.states.back().state, TrackingState::kLive);
    for (std::size_t i = 0; i < bench.host.states.size(); ++i) ASSERT_EQ(bench.host.states[i].sequence, i);
    EXPECT_FALSE(bench.watchdog.expired());
}

TEST(DaemonLockstep, AFrozenCameraIsNotBelieved) {
    BenchOptions options;
    options.frames = 100;
    options.faults.events = {fault(FaultKind::kCameraFrozen, 30, 20, 0)};
    DaemonBench bench(options);
    static_cast<void>(bench.run());
    EXPECT_EQ(bench.host.states[40].cameras[0], CameraStatus::kFrozen);
    EXPECT_NE(bench.host.states[40].faults & fault_bit(Fault::kCameraFrozen), 0U);
    EXPECT_EQ(bench.host.states[60].cameras[0], CameraStatus::kGood);
}

TEST(DaemonLockstep, BrokenAndLateFramesAreCountedAndLeftOut) {
    BenchOptions options;
    options.frames = 100;
    options.faults.events = {fault(FaultKind::kCameraShort, 20, 2, 0), fault(FaultKind::kCameraIo, 40, 1, 1),
                             fault(FaultKind::kCameraReorder, 60, 1, 0)};
    DaemonBench bench(options);
    static_cast<void>(bench.run());
    const auto counts = bench.app().health().fault_counts;
    const auto raised = [&](Fault each) { return counts[static_cast<std::size_t>(each) - 1]; };
    EXPECT_GE(raised(Fault::kShortFrame), 1);
    EXPECT_GE(raised(Fault::kCameraIo), 1);
    EXPECT_GE(raised(Fault::kLateFrame), 1);
    EXPECT_GE(raised(Fault::kSequenceGap), 1);
    std::int64_t last_us = 0;
    for (const FaceState& state : bench.host.states) {
        EXPECT_GE(state.capture_us, last_us);
        last_us = state.capture_us;
    }
    EXPECT_EQ(bench.host.states.back().state, TrackingState::kLive);
}

TEST(DaemonLockstep, TheButtonFindsIdentitiesAnew) {
    DaemonBench plain;
    static_cast<void>(plain.run());
    DaemonBench pressed;
    pressed.before_tick = [](DaemonBench& bench, std::uint32_t tick) {
        if (tick == 30) bench.button.drive(true);
        if (tick == 33) bench.button.drive(false);
    };
    static_cast<void>(pressed.run());
    EXPECT_EQ(pressed.app().health().bootstraps, plain.app().health().bootstraps + 1);
}

TEST(DaemonLockstep, WithoutAPackItIsSafeAndTalks) {
    BenchOptions options;
    options.with_pack = false;
    DaemonBench bench(options);
    bench.before_tick = [](DaemonBench& b, std::uint32_t tick) {
        if (tick == 5) b.host.send(MessageType::kHelloRequest, ByteSpan{});
    };
    static_cast<void>(bench.run());
    ASSERT_EQ(bench.host.states.size(), 60U);
    for (const FaceState& state : bench.host.states) {
        EXPECT_EQ(state.state, TrackingState::kSafe);
        EXPECT_EQ(state.shape_count, 0);
        EXPECT_TRUE(state.held);
    }
    EXPECT_EQ(bench.host.count(MessageType::kHello), 1U);
}

TEST(DaemonLockstep, StopEndsItWithAGoodbye) {
    BenchOptions options;
    options.frames = 100000;
    DaemonBench bench(options);
    bench.before_tick = [](DaemonBench& b, std::uint32_t tick) {
        if (tick == 20) b.stop = true;
    };
    EXPECT_EQ(bench.run(), AppEnd::kStopped);
    EXPECT_EQ(bench.host.count(MessageType::kGoodbye), 1U);
    EXPECT_EQ(bench.host.last_status().ticks, 20U);
}

// The whole conversation of PROTOCOL.md, section 2, with a host that comes late.
TEST(DaemonLockstep, AHostJoinsAsksAndLeaves) {
    BenchOptions options;
    options.frames = 80;
    options.streams_by_itself = false;
    DaemonBench bench(options);
    bench.before_tick = [](DaemonBench& b, std::uint32_t tick) {
        Hello hello;
        hello.session_id = 5;
        if (tick == 10) b.host.send(MessageType::kHelloRequest, ByteSpan{});
        if (tick == 11) b.host.send(MessageType::kHello, hello);
        if (tick == 12) b.host.send(MessageType::kNamesRequest, NamesRequest{NameKind::kShapes, 0});
        if (tick == 13) b.host.send(MessageType::kTimeRequest, TimeRequest{123});
        if (tick == 20)
            b.host.send(MessageType::kStartStreams, StartStreams{kStreamWeights | kStreamStatus, 2, 1, 10});
        if (tick == 30) {
            hello.session_id = 6;  // another host
            b.host.send(MessageType::kHello, hello);
        }
        if (tick == 40) b.host.send(MessageType::kStopStreams, StopStreams{kStreamStatus});
        if (tick == 60) b.host.send(MessageType::kGoodbye, GoodbyeMessage{});
    };
    static_cast<void>(bench.run());
    const auto hello = decode_hello(*bench.host.last(MessageType::kHello)).value();
    EXPECT_EQ(hello.role, Role::kBoard);
    EXPECT_EQ(hello.session_id, 77U);
    EXPECT_EQ(hello.shape_count, 30);
    const auto names = decode_names(*bench.host.last(MessageType::kNames)).value();
    EXPECT_EQ(names.total, 30);
    EXPECT_EQ(names.names[3], "shape3");
    const auto time = decode_time_reply(*bench.host.last(MessageType::kTimeReply)).value();
    EXPECT_EQ(time.host_sent_us, 123);
    EXPECT_GT(time.board_received_us, 1'000'000);
    EXPECT_EQ(bench.host.count(MessageType::kAck), 3U);
    EXPECT_EQ(decode_nak(*bench.host.last(MessageType::kNak))->reason, NakReason::kBusy);
    ASSERT_GE(bench.host.states.size(), 19U);
    EXPECT_LE(bench.host.states.size(), 21U);  // every second tick of forty
    EXPECT_EQ(bench.host.states[1].sequence - bench.host.states[0].sequence, 2U);
    EXPECT_GE(bench.host.count(MessageType::kStatus), 2U);
    EXPECT_LE(bench.host.count(MessageType::kStatus), 3U);
    EXPECT_EQ(bench.host.count(MessageType::kGoodbye), 1U);
}

TEST(DaemonLockstep, ResetComesFromTheHostToo) {
    DaemonBench bench;
    bench.before_tick = [](DaemonBench& b, std::uint32_t tick) {
        if (tick == 30) b.host.send(MessageType::kCommand, CommandMessage{BoardCommand::kResetTracking});
    };
    static_cast<void>(bench.run());
    EXPECT_EQ(bench.app().health().bootstraps, 2U);
    EXPECT_EQ(bench.host.count(MessageType::kAck), 1U);
}

std::vector<std::string> log_lines(const TestHost& host) {
    std::vector<std::string> lines;
    for (const auto& [head, payload] : host.frames) {
        if (head.type != MessageType::kEvent) continue;
        const auto event = decode_event(payload);
        if (event && event->kind == EventKind::kLog) lines.emplace_back(event->text.view());
    }
    return lines;
}

TEST(DaemonLockstep, ANeutralIsRefusedWhileTheFaceTalksAndTheReasonIsTold) {
    BenchOptions options;
    options.frames = 100;
    DaemonBench bench(options);
    bench.before_tick = [](DaemonBench& b, std::uint32_t tick) {
        if (tick == 20) b.host.send(MessageType::kCommand, CommandMessage{BoardCommand::kNeutral});
    };
    static_cast<void>(bench.run());
    EXPECT_EQ(bench.host.count(MessageType::kAck), 1U);
    const auto lines = log_lines(bench.host);
    ASSERT_EQ(lines.size(), 1U);
    EXPECT_TRUE(lines[0].starts_with("neutral refused: the face moved, a marker by ")) << lines[0];
    // Nothing has changed.
    DaemonBench plain(options);
    static_cast<void>(plain.run());
    EXPECT_EQ(bench.app().digest().value(), plain.app().digest().value());
}

TEST(DaemonLockstep, ANeutralOfAFaceAtRestIsTakenAndForgotten) {
    PaintedTakeOptions still;
    still.at_rest = true;
    still.aside_mm = 0.8;
    const PaintedTake take(still);
    BenchOptions options;
    options.frames = 160;
    options.take = &take;
    DaemonBench bench(options);
    bench.before_tick = [](DaemonBench& b, std::uint32_t tick) {
        if (tick == 20) b.host.send(MessageType::kCommand, CommandMessage{BoardCommand::kNeutral});
        if (tick == 120) b.host.send(MessageType::kCommand, CommandMessage{BoardCommand::kForgetNeutral});
    };
    static_cast<void>(bench.run());
    EXPECT_EQ(bench.host.count(MessageType::kAck), 2U);
    const auto lines = log_lines(bench.host);
    ASSERT_EQ(lines.size(), 1U);
    EXPECT_TRUE(lines[0].starts_with("neutral taken: offsets of 0.")) << lines[0];
    const auto largest = [&](std::size_t tick) {
        float most = 0.0F;
        for (const float w : bench.host.states[tick].weights) most = std::max(most, w);
        return most;
    };
    std::printf("largest weight at rest, dots glued 0.8 mm aside: %.3f before, %.3f after the neutral\n",
                static_cast<double>(largest(60)), static_cast<double>(largest(110)));
    EXPECT_LT(largest(110), 0.25F * largest(60));
    EXPECT_NEAR(static_cast<double>(largest(155)), static_cast<double>(largest(60)), 0.1);
}

TEST(DaemonLockstep, WithoutAPackThereIsNoNeutralToTake) {
    BenchOptions options;
    options.with_pack = false;
    DaemonBench bench(options);
    bench.before_tick = [](DaemonBench& b, std::uint32_t tick) {
        if (tick == 5) b.host.send(MessageType::kCommand, CommandMessage{BoardCommand::kNeutral});
    };
    static_cast<void>(bench.run());
    EXPECT_EQ(decode_nak(*bench.host.last(MessageType::kNak))->reason, NakReason::kNotNow);
}

// The wish of an artist is in the weights of the next tick, and only in those it was for.
TEST(DaemonLockstep, ALiveControlChangesTheStreamedWeights) {
    DaemonBench plain;
    static_cast<void>(plain.run());
    DaemonBench bench;
    bench.before_tick = [](DaemonBench& b, std::uint32_t tick) {
        if (tick == 30)
            b.host.send(MessageType::kControl, control_of(ControlKind::kRange, {0, 5}, 0.25F, 0.5F));
        if (tick == 45)
            b.host.send(MessageType::kControl, ControlMessage{.neutral_first = true, .edits = {}});
    };
    static_cast<void>(bench.run());
    EXPECT_EQ(bench.host.count(MessageType::kAck), 2U);
    ASSERT_EQ(bench.host.states.size(), 60U);
    bool narrowed = false;
    for (std::size_t i = 0; i < 60; ++i) {
        const FaceState& state = bench.host.states[i];
        const FaceState& before = plain.host.states[i];
        if (i < 30) {
            EXPECT_EQ(state.weights, before.weights) << i;
            narrowed = narrowed || before.weights[0] < 0.2F || before.weights[5] < 0.2F;
        }
        if (i > 31 && i < 45) {
            for (const std::size_t shape : {0U, 5U})
                EXPECT_TRUE(state.weights[shape] >= 0.25F && state.weights[shape] <= 0.5F) << i;
        }
    }
    EXPECT_TRUE(narrowed) << "the range was no news";
    EXPECT_NE(bench.app().digest().value(), plain.app().digest().value());
    EXPECT_NEAR(bench.host.states[59].weights[0], plain.host.states[59].weights[0], 0.02F);
}

TEST(DaemonLockstep, ControlsThatCannotBeAreRefusedWhole) {
    DaemonBench plain;
    static_cast<void>(plain.run());
    DaemonBench bench;
    bench.before_tick = [](DaemonBench& b, std::uint32_t tick) {
        if (tick != 20) return;
        ControlMessage message = control_of(ControlKind::kOffset, {0}, 0.5F);
        ControlEdit beyond = message.edits[0];
        put_in(beyond.shapes, 200);  // the pack has 30
        static_cast<void>(message.edits.push_back(beyond));
        b.host.send(MessageType::kControl, message);
    };
    static_cast<void>(bench.run());
    EXPECT_EQ(decode_nak(*bench.host.last(MessageType::kNak))->reason, NakReason::kBadValue);
    EXPECT_EQ(bench.app().digest().value(), plain.app().digest().value());
    BenchOptions options;
    options.with_pack = false;
    DaemonBench safe(options);
    safe.before_tick = [](DaemonBench& b, std::uint32_t tick) {
        if (tick == 5) b.host.send(MessageType::kControl, control_of(ControlKind::kOffset, {0}, 0.5F));
    };
    static_cast<void>(safe.run());
    EXPECT_EQ(decode_nak(*safe.host.last(MessageType::kNak))->reason, NakReason::kNotNow);
}

// Age is true: the weights are of the frame that the filter answers for.
TEST(DaemonLockstep, TheDelayOfTheFilterIsInCaptureTimeAndAge) {
    DaemonBench plain;
    static_cast<void>(plain.run());
    BenchOptions options;
    options.smoothing = same_filter({FilterKind::kSavitzkyGolay, 15}, 7);
    DaemonBench delayed(options);
    static_cast<void>(delayed.run());
    ASSERT_EQ(delayed.host.states.size(), 60U);
    const FaceState& now = plain.host.states[50];
    const FaceState& late = delayed.host.states[50];
    EXPECT_EQ(late.capture_us, plain.host.states[43].capture_us);
    EXPECT_EQ(late.age_us - now.age_us, now.capture_us - late.capture_us);
}

TEST(DaemonLockstep, HostileBytesChangeNothing) {
    DaemonBench quiet;
    static_cast<void>(quiet.run());
    DaemonBench bench;
    SeededRandom random(3);
    bench.before_tick = [&](DaemonBench& b, std::uint32_t) {
        for (int i = 0; i < 30; ++i) {
            std::array<std::byte, 256> bytes{};
            for (std::byte& each : bytes) each = static_cast<std::byte>(random.below(256));
            const auto length = static_cast<std::size_t>(random.below(200));  // | 64 stays inside
            if (i % 2 == 0) b.host.send_bytes(ByteSpan(bytes).first(length));
            // Whole frames of every type, right and wrong lengths. Not those that do change something:
            // streams, reset.
            const auto type = static_cast<std::uint8_t>(random.below(256));
            const bool asks = type >= 0x20 && type <= 0x24;
            if (i % 2 == 1 && !asks)
                b.host.send(static_cast<MessageType>(type), ByteSpan(bytes).first(length));
            if (i % 2 == 1 && asks)
                b.host.send(static_cast<MessageType>(type), ByteSpan(bytes).first(length | 64U));
        }
        b.wall.sleep_until_us(b.wall.now_us() + kFrame_us);
    };
    static_cast<void>(bench.run());
    EXPECT_EQ(bench.app().digest().value(), quiet.app().digest().value());
    EXPECT_EQ(bench.host.states.size(), 60U);
    EXPECT_EQ(bench.host.counters().bad(), 0U);
    const double seconds = static_cast<double>(bench.wall.now_us()) * 1e-6;
    EXPECT_GT(bench.host.count(MessageType::kNak), 0U);
    EXPECT_LE(static_cast<double>(bench.host.count(MessageType::kNak)), 10.0 * seconds + 11.0);
    EXPECT_GT(bench.host.last_status().rx_bad, 0U);
    EXPECT_GT(bench.app().health().fault_counts[static_cast<std::size_t>(Fault::kBadCommand) - 1], 0);
    EXPECT_GT(bench.app().health().fault_counts[static_cast<std::size_t>(Fault::kLineNoise) - 1], 0);
}

TEST(DaemonLockstep, AFloodOfCommandsIsDropped) {
    DaemonBench bench;
    bench.before_tick = [](DaemonBench& b, std::uint32_t) {
        for (int i = 0; i < 300; ++i) b.host.send(MessageType::kHelloRequest, ByteSpan{});
    };
    static_cast<void>(bench.run());
    EXPECT_EQ(bench.host.states.size(), 60U);
    EXPECT_GT(bench.app().health().fault_counts[static_cast<std::size_t>(Fault::kCommandFlood) - 1], 0);
}

// Light that rises and falls by four is taken back by exposure, and the face is live again within a second.
TEST(DaemonLockstep, AutoExposureBringsTheFaceBackWhenTheLightChanges) {
    const auto live_at_end = [](bool controlled, double lamp) {
        BenchOptions options;
        options.frames = 240;
        options.lamp = [lamp](std::uint32_t frame) { return frame < 60 ? 1.0 : lamp; };
        if (controlled) options.exposure = ExposureConfig{};
        DaemonBench bench(options);
        static_cast<void>(bench.run());
        int live = 0;
        for (std::size_t i = 150; i < bench.host.states.size(); ++i)
            live += bench.host.states[i].state == TrackingState::kLive ? 1 : 0;
        const double exposure_us = bench.lit_camera(0).exposure_us();
        if (!controlled) {
            EXPECT_EQ(exposure_us, LampSource::kNominal_us);
        } else if (lamp > 1.0) {
            EXPECT_LT(exposure_us, 1000.0);
        } else {
            EXPECT_GT(exposure_us, 3000.0);
        }
        return live;
    };
    EXPECT_EQ(live_at_end(true, 4.0), 90);
    EXPECT_EQ(live_at_end(true, 0.25), 90);
    EXPECT_LT(live_at_end(false, 6.0), 45);  // without control such light ends it
}

// A recorded take solves again to the same digest.
TEST(DaemonLockstep, TheObservationLogRepeatsTheRun) {
    const TempFolder folder;
    BenchOptions options;
    options.frames = 120;
    options.log_path = folder / "take.rgo";
    options.faults.events = {fault(FaultKind::kCameraGone, 40, 10, 1),
                             fault(FaultKind::kExposureFlash, 80, 3, 0, 200.0)};
    DaemonBench bench(options);
    bench.before_tick = [](DaemonBench& b, std::uint32_t tick) {
        if (tick == 100) b.button.drive(true);
        if (tick == 60)
            b.host.send(MessageType::kControl, control_of(ControlKind::kMultiplier, {0, 1, 2}, 0.5F));
    };
    static_cast<void>(bench.run());

    std::ifstream file(options.log_path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    auto log = ObservationLogReader::open(std::as_bytes(std::span(text))).value();
    EXPECT_EQ(log.header().camera_count, 2);
    const auto pipeline = std::make_unique<Pipeline>();
    PipelineConfig config;
    config.rate_hz = log.header().rate_millihertz / 1000.0;
    ASSERT_TRUE(pipeline->configure(painted_take().pack(), config));
    OutputGate gate;
    gate.configure(painted_take().pack().weight_low, painted_take().pack().weight_high);
    StreamDigest digest;
    FaceState state;
    FrameReport report;
    int control_changes = 0;
    while (!log.at_end()) {
        const auto tick = log.next();
        ASSERT_TRUE(tick.has_value());
        if (tick->reset_before) pipeline->reset_tracking();
        if (tick->neutral_forgotten_before) pipeline->forget_neutral();
        if (tick->neutral_before) pipeline->begin_neutral();
        if (tick->new_controls != nullptr) {
            ASSERT_TRUE(pipeline->set_controls(*tick->new_controls).has_value());
            ++control_changes;
        }
        ObservationFrame frame;
        frame.capture_us = tick->capture_us;
        frame.camera_count = log.header().camera_count;
        frame.cameras = tick->cameras;
        frame.status = tick->status;
        pipeline->step(frame, state, report);
        EXPECT_EQ(state.sequence, tick->number);
        static_cast<void>(gate.pass(state));
        digest.add(state);
    }
    EXPECT_EQ(control_changes, 1);
    EXPECT_EQ(digest.ticks(), bench.app().digest().ticks());
    EXPECT_EQ(digest.value(), bench.app().digest().value());
}

}  // namespace
}  // namespace rig::test
