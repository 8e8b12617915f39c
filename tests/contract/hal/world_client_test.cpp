// The world boundary beyond the contracts: lockstep's order of events, worlds that go away, and worlds that
// lie.
#include "hal/sim/world_client.hpp"

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <thread>

#include "hal/sim/world_ledger.hpp"
#include "tests/contract/hal/fake_world.hpp"
#include "tests/support/random.hpp"

namespace rig::test {
namespace {

using sim::WorldClient;
using sim::WorldHello;
using sim::WorldMessage;
using sim::WorldMessageKind;
using sim::WorldPace;

constexpr sim::WorldPatience kQuick{.connect_us = 300'000, .silence_us = 300'000};

std::unique_ptr<WorldClient> join(FakeWorld& world) {
    std::thread greeter([&] { world.accept_and_greet(); });
    auto client = WorldClient::connect(world.path(), kQuick);
    greeter.join();
    return client ? std::move(*client) : nullptr;
}

class LockstepWorld : public testing::Test {
  protected:
    void SetUp() override {
        ASSERT_NE(client_, nullptr);
        for (std::size_t c = 0; c < 2; ++c) ASSERT_TRUE(client_->camera(c).start());
    }
    Result<CameraFrame, FrameError> wait(std::size_t camera) {
        return client_->camera(camera).wait_frame(client_->clock().now_us() + 1'000'000);
    }
    FakeWorld world_{WorldPace::kLockstep};
    std::unique_ptr<WorldClient> client_ = join(world_);
};

TEST_F(LockstepWorld, ATickIsOneFrameSet) {
    world_.paint(0, 1);
    world_.send(frame_set(0, 1, 10'000));
    const auto first = wait(0);
    const auto second = wait(1);
    ASSERT_TRUE(first && second);
    EXPECT_EQ(client_->clock().now_us(), 10'000);
    EXPECT_EQ(first->image.row(0)[0], 16);
    EXPECT_EQ(second->image.row(0)[0], 17);
    EXPECT_EQ(first->capture_us, 10'000);
    EXPECT_EQ(wait(0).error(), FrameError::kTimeout);  // the world waits for us: no use in waiting for it
    client_->camera(0).release(first->token);
    client_->camera(1).release(second->token);
    client_->tick_done();
    client_->tick_done();  // nothing to acknowledge any more
    WorldMessage message;
    ASSERT_TRUE(world_.receive(message));
    EXPECT_EQ(message.kind, WorldMessageKind::kSlotFree);
    ASSERT_TRUE(world_.receive(message));
    EXPECT_EQ(message.kind, WorldMessageKind::kTickDone);
    EXPECT_EQ(message.sequence, 1U);
    EXPECT_FALSE(world_.receive(message, 30));
}

TEST_F(LockstepWorld, ACameraWithoutAnImageTimesOutAtOnce) {
    world_.send(frame_set(0, 1, 10'000, 1));
    EXPECT_TRUE(wait(0).has_value());
    EXPECT_EQ(wait(1).error(), FrameError::kTimeout);
    client_->tick_done();
    world_.send(frame_set(1, 2, 20'000, 0));
    EXPECT_EQ(wait(0).error(), FrameError::kTimeout);
    EXPECT_EQ(client_->clock().now_us(), 20'000);
}

TEST_F(LockstepWorld, AdvanceEndsAWait) {
    world_.send(plain(WorldMessageKind::kAdvance, 5'000));
    world_.send(plain(WorldMessageKind::kAdvance, 40'000));
    EXPECT_EQ(client_->camera(0).wait_frame(30'000).error(), FrameError::kTimeout);
    EXPECT_EQ(client_->clock().now_us(), 40'000);
}

// What a tick sees must not depend on how the socket groups messages.
TEST_F(LockstepWorld, MessagesAfterAFrameSetBelongToTheNextTick) {
    world_.send(line_edge(sim::WorldLine::kButtonNeutral, true, 9'000));
    world_.send(frame_set(0, 1, 10'000));
    world_.send(line_edge(sim::WorldLine::kButtonNeutral, false, 11'000));
    GpioLine& button = client_->line(sim::WorldLine::kButtonNeutral);
    ASSERT_TRUE(wait(0).has_value());
    ASSERT_TRUE(button.wait_edge(client_->clock().now_us()).has_value());
    EXPECT_EQ(button.wait_edge(client_->clock().now_us() + 1000).error(), GpioError::kTimeout);
    client_->tick_done();
    world_.send(frame_set(1, 2, 20'000));
    ASSERT_TRUE(wait(0).has_value());
    EXPECT_FALSE(button.wait_edge(client_->clock().now_us())->rising);
}

TEST_F(LockstepWorld, EndComesAfterTheQueuedFrames) {
    world_.send(frame_set(0, 1, 10'000));
    world_.send(plain(WorldMessageKind::kEnd));
    world_.hang_up();
    ASSERT_TRUE(wait(0).has_value());
    ASSERT_TRUE(wait(1).has_value());
    client_->tick_done();
    EXPECT_EQ(wait(0).error(), FrameError::kEnded);
    EXPECT_EQ(wait(1).error(), FrameError::kEnded);
    EXPECT_TRUE(client_->ended());
}

TEST_F(LockstepWorld, HangingUpBeforeTheEndIsGone) {
    world_.hang_up();
    EXPECT_EQ(wait(0).error(), FrameError::kGone);
    EXPECT_EQ(wait(1).error(), FrameError::kGone);
    EXPECT_NE(client_->fault(), nullptr);
    EXPECT_EQ(client_->camera(0).start().error(), FrameError::kGone);
}

TEST_F(LockstepWorld, SilenceIsGone) {
    EXPECT_EQ(wait(0).error(), FrameError::kGone);
    EXPECT_STREQ(client_->fault(), "the world said nothing for too long");
}

TEST_F(LockstepWorld, InterruptEndsAWait) {
    std::thread interrupter([this] {
        std::this_thread::sleep_for(std::chrono::milliseconds(30));
        client_->clock().interrupt();
    });
    EXPECT_EQ(wait(0).error(), FrameError::kTimeout);
    interrupter.join();
    EXPECT_EQ(client_->fault(), nullptr);
}

TEST_F(LockstepWorld, ControlsReachTheWorld) {
    ASSERT_TRUE(client_->camera(1).set_exposure_us(1234));
    ASSERT_TRUE(client_->camera(1).set_gain_db(3.0F));
    WorldMessage message;
    ASSERT_TRUE(world_.receive(message));
    EXPECT_EQ(message.kind, WorldMessageKind::kExposure);
    EXPECT_EQ(message.camera_or_line, 1);
    EXPECT_EQ(message.value, 1234.0F);
    ASSERT_TRUE(world_.receive(message));
    EXPECT_EQ(message.kind, WorldMessageKind::kGain);
    EXPECT_EQ(message.value, 3.0F);
}

struct BadMessage {
    const char* name;
    WorldMessage message;
};

class HostileWorld : public testing::TestWithParam<BadMessage> {};

TEST_P(HostileWorld, BreakingTheProtocolIsGone) {
    FakeWorld world(WorldPace::kLockstep);
    const auto client = join(world);
    ASSERT_NE(client, nullptr);
    ASSERT_TRUE(client->camera(0).start());
    world.send(frame_set(0, 0, 1'000'000, 2));
    world.send(GetParam().message);
    ASSERT_EQ(client->camera(0).wait_frame(2'000'000).error(), FrameError::kTimeout);
    client->tick_done();
    const auto frame = client->camera(0).wait_frame(2'000'000);
    ASSERT_FALSE(frame.has_value());
    EXPECT_EQ(frame.error(), FrameError::kGone);
    EXPECT_NE(client->fault(), nullptr);
}

WorldMessage edge(std::uint8_t line, std::uint8_t active, std::int64_t time_us) {
    WorldMessage message = line_edge(sim::WorldLine::kTrigger, false, time_us);
    message.camera_or_line = line;
    message.active = active;
    return message;
}

INSTANTIATE_TEST_SUITE_P(Messages, HostileWorld,
                         testing::Values(BadMessage{"SlotBeyondTheRing", frame_set(4, 1, 2'000'000)},
                                         BadMessage{"SlotFarBeyond", frame_set(0xFFFF'FFFF, 1, 2'000'000)},
                                         BadMessage{"CameraBeyondTheCount", frame_set(0, 1, 2'000'000, 0x04)},
                                         BadMessage{"AllCamerasClaimed", frame_set(0, 1, 2'000'000, 0xFF)},
                                         BadMessage{"FrameGoesBack", frame_set(0, 1, 999'999)},
                                         BadMessage{"FrameRepeats", frame_set(0, 1, 1'000'000)},
                                         BadMessage{"AdvanceGoesBack",
                                                    plain(WorldMessageKind::kAdvance, 999'999)},
                                         BadMessage{"NegativeTime", plain(WorldMessageKind::kAdvance, -1)},
                                         BadMessage{"HugeTime", plain(WorldMessageKind::kAdvance, INT64_MAX)},
                                         BadMessage{"LineBeyondTheCount", edge(6, 1, 2'000'000)},
                                         BadMessage{"NeitherHighNorLow", edge(0, 2, 2'000'000)},
                                         BadMessage{"OurOwnKind", plain(WorldMessageKind::kTickDone)},
                                         BadMessage{"UnknownKind", plain(static_cast<WorldMessageKind>(77))}),
                         [](const auto& bad) { return std::string(bad.param.name); });

TEST(WorldLedger, ASlotInUseMayNotBeWritten) {
    sim::WorldLedger ledger(small_hello(WorldPace::kRealTime));
    ledger.listen(0, true);
    EXPECT_EQ(ledger.accept(frame_set(2, 1, 1000)), nullptr);
    EXPECT_NE(ledger.accept(frame_set(2, 2, 2000)), nullptr);
    ASSERT_TRUE(ledger.has_frame(0));
    EXPECT_TRUE(ledger.release(0, ledger.take_frame(0).slot));
    EXPECT_FALSE(ledger.release(0, 2));
    EXPECT_EQ(ledger.take_freed_slots().size(), 1U);
    EXPECT_EQ(ledger.accept(frame_set(2, 3, 3000)), nullptr);
}

TEST(WorldLedger, ASlowCameraLosesTheOldestFrame) {
    WorldHello hello = small_hello(WorldPace::kRealTime);
    hello.slot_count = 8;
    sim::WorldLedger ledger(hello);
    ledger.listen(1, true);
    for (std::uint32_t i = 0; i < 6; ++i) EXPECT_EQ(ledger.accept(frame_set(i, i, 1000 * i)), nullptr);
    EXPECT_EQ(ledger.dropped_frames(), 2U);
    EXPECT_EQ(ledger.take_frame(1).sequence, 2U);
    const auto freed = ledger.take_freed_slots();
    ASSERT_EQ(freed.size(), 2U);
    EXPECT_EQ(freed[0], 0U);
    EXPECT_EQ(freed[1], 1U);
}

// Any message at any time: never more slots held than there are, never a crash.
TEST(WorldLedger, RandomMessagesKeepTheBooks) {
    SeededRandom random(7);
    for (int round = 0; round < 200; ++round) {
        const WorldHello hello = small_hello(round % 2 == 0 ? WorldPace::kRealTime : WorldPace::kLockstep);
        sim::WorldLedger ledger(hello);
        std::int64_t time_us = 0;
        for (int step = 0; step < 500; ++step) {
            const auto camera = static_cast<std::size_t>(random.below(2));
            switch (random.below(6)) {
                case 0:
                    ledger.listen(camera, random.chance(0.8));
                    break;
                case 1:
                    if (ledger.has_frame(camera)) static_cast<void>(ledger.take_frame(camera));
                    break;
                case 2:
                    static_cast<void>(ledger.release(camera, static_cast<std::uint32_t>(random.below(6))));
                    break;
                case 3:
                    ledger.finish_tick();
                    break;
                case 4:
                    EXPECT_LE(ledger.take_freed_slots().size(), hello.slot_count);
                    break;
                default: {
                    WorldMessage message;
                    message.kind = static_cast<WorldMessageKind>(1 + random.below(3));
                    message.slot = static_cast<std::uint32_t>(random.below(5));
                    message.camera_mask = static_cast<std::uint8_t>(random.below(5));
                    message.camera_or_line = static_cast<std::uint8_t>(random.below(7));
                    message.active = static_cast<std::uint8_t>(random.below(3));
                    message.time_us = time_us += static_cast<std::int64_t>(random.below(3));
                    static_cast<void>(ledger.accept(message));
                }
            }
        }
    }
}

struct BadHello {
    const char* name;
    std::function<void(WorldHello&)> spoil;
};

class HostileHello : public testing::TestWithParam<BadHello> {};

TEST_P(HostileHello, IsRefused) {
    WorldHello hello = small_hello(WorldPace::kLockstep);
    const std::uint64_t file_bytes = hello.memory_bytes;
    ASSERT_TRUE(sim::hello_is_sound(hello, file_bytes));
    GetParam().spoil(hello);
    EXPECT_FALSE(sim::hello_is_sound(hello, file_bytes));
    FakeWorld world(WorldPace::kLockstep);
    std::thread greeter([&] { world.accept_and_send(std::as_bytes(std::span(&hello, 1)), true); });
    const auto client = WorldClient::connect(world.path(), kQuick);
    greeter.join();
    ASSERT_FALSE(client.has_value());
    EXPECT_EQ(client.error(), sim::WorldError::kRefusedHello);
}

INSTANTIATE_TEST_SUITE_P(
    Hellos, HostileHello,
    testing::Values(
        BadHello{"Magic", [](WorldHello& h) { h.magic ^= 1; }},
        BadHello{"Version", [](WorldHello& h) { ++h.version; }},
        BadHello{"Pace", [](WorldHello& h) { h.pace = static_cast<WorldPace>(2); }},
        BadHello{"NoCamera", [](WorldHello& h) { h.camera_count = 0; }},
        BadHello{"TooManyCameras", [](WorldHello& h) { h.camera_count = 5; }},
        BadHello{"NoWidth", [](WorldHello& h) { h.width_px = 0; }},
        BadHello{"TooWide", [](WorldHello& h) { h.width_px = 1921; }},
        BadHello{"TooHigh", [](WorldHello& h) { h.height_px = 1201; }},
        BadHello{"NoRate", [](WorldHello& h) { h.rate_millihertz = 0; }},
        BadHello{"AbsurdRate", [](WorldHello& h) { h.rate_millihertz = 0xFFFF'FFFF; }},
        BadHello{"NoSlots", [](WorldHello& h) { h.slot_count = 0; }},
        BadHello{"TooManySlots", [](WorldHello& h) { h.slot_count = 65; }},
        BadHello{"StrideUnderImage", [](WorldHello& h) { h.image_stride_bytes = 47; }},
        BadHello{"ImagesBeyondMemory", [](WorldHello& h) { h.image_stride_bytes = 65; }},
        BadHello{"OffsetBeyondMemory", [](WorldHello& h) { h.image_offset = h.memory_bytes + 1; }},
        BadHello{"OffsetOverflows", [](WorldHello& h) { h.image_offset = ~std::uint64_t{0} - 100; }},
        BadHello{"MemoryBeyondFile", [](WorldHello& h) { ++h.memory_bytes; }},
        BadHello{"AbsurdMemory", [](WorldHello& h) { h.memory_bytes = ~std::uint64_t{0}; }}),
    [](const auto& bad) { return std::string(bad.param.name); });

TEST(WorldClientConnect, NobodyThere) {
    const TempFolder folder;
    EXPECT_EQ(WorldClient::connect(folder / "nothing.sock", kQuick).error(), sim::WorldError::kNoWorld);
    EXPECT_EQ(WorldClient::connect(std::string(500, 'x'), kQuick).error(), sim::WorldError::kNoWorld);
    EXPECT_EQ(WorldClient::connect("", kQuick).error(), sim::WorldError::kNoWorld);
}

TEST(WorldClientConnect, AHelloWithoutMemoryOrCutShortIsRefused) {
    const WorldHello hello = small_hello(WorldPace::kLockstep);
    const auto bytes = std::as_bytes(std::span(&hello, 1));
    for (const bool with_memory : {false, true}) {
        FakeWorld world(WorldPace::kLockstep);
        std::thread greeter(
            [&] { world.accept_and_send(with_memory ? bytes.first(20) : bytes, with_memory); });
        EXPECT_EQ(WorldClient::connect(world.path(), kQuick).error(), sim::WorldError::kRefusedHello);
        greeter.join();
    }
}

TEST(WorldClientRealTime, TwoCamerasInTwoThreadsToTheEnd) {
    FakeWorld world(WorldPace::kRealTime);
    world.perform(30);
    const auto client = std::move(*WorldClient::connect(world.path()));
    std::array<int, 2> frames{};
    std::array<std::thread, 2> threads;
    for (std::size_t c = 0; c < 2; ++c) {
        ASSERT_TRUE(client->camera(c).start());
        threads[c] = std::thread([&, c] {
            while (true) {
                const auto frame = client->camera(c).wait_frame(client->clock().now_us() + 100'000);
                if (!frame && frame.error() != FrameError::kTimeout) return;
                if (!frame) continue;
                EXPECT_EQ(frame->image.row(5)[7], static_cast<std::uint8_t>(frame->sequence * 16 + c));
                client->camera(c).release(frame->token);
                ++frames[c];
            }
        });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_TRUE(client->ended());
    EXPECT_GE(frames[0], 1);  // a starved machine drops frames, as a slow daemon would
    EXPECT_GE(frames[1], 1);
}

}  // namespace
}  // namespace rig::test
