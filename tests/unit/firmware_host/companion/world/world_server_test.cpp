#include "firmware_host/companion/world/world_server.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <map>

#include "hal/sim/world_client.hpp"
#include "tests/support/digest.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/firmware_host/companion/world/test_head.hpp"
#include "tests/unit/firmware_host/companion/world/world_visitor.hpp"

namespace rig::host {
namespace {

using rig::test::WorldVisitor;
using sim::WorldLine;
using sim::WorldMessage;
using sim::WorldMessageKind;
using sim::WorldPace;

class WorldServerTest : public ::testing::Test {
  protected:
    void SetUp() override {
        WorldConfig config;
        config.cameras = {rig::test::straight_camera(-0.1, 0.01), rig::test::straight_camera()};
        config.cameras[1].centre_mm[0] = 30.0;
        config.frame_count = 20;
        world_ = rig::test::make_world(rig::test::flat_head(), config);
    }

    ServerConfig served(WorldPace pace) {
        ServerConfig config;
        config.socket = folder_ / "world";
        config.pace = pace;
        config.slot_count = 5;
        config.connect_timeout_us = 30'000'000;
        return config;
    }

    std::uint64_t expected_digest(std::size_t frame, const CameraControl& control = {}) {
        WorldRenderer renderer(*world_);
        std::vector<std::uint8_t> image(world_->image_bytes());
        rig::test::Digest digest;
        for (std::size_t camera = 0; camera < 2; ++camera) {
            renderer.render(frame, camera, control, image);
            digest.add(std::span<const std::uint8_t>(image));
        }
        return digest.value();
    }

    static std::uint64_t digest_of(const WorldVisitor& visitor, std::uint32_t slot) {
        return rig::test::Digest().add(visitor.image(slot, 0)).add(visitor.image(slot, 1)).value();
    }

    rig::test::TempFolder folder_;
    std::unique_ptr<World> world_;
};

TEST_F(WorldServerTest, LockstepShowsEveryFrameOnceInOrder) {
    for (const std::size_t threads : {1U, 2U}) {
        ServerConfig config = served(WorldPace::kLockstep);
        config.render_threads = threads;
        WorldServer server(*world_, config);
        ASSERT_TRUE(server.listen());
        server.start();
        WorldVisitor visitor(config.socket);
        ASSERT_TRUE(visitor.ok());
        EXPECT_EQ(visitor.hello().magic, sim::kWorldMagic);
        EXPECT_EQ(visitor.hello().camera_count, 2);
        EXPECT_EQ(visitor.hello().frame_total, 20U);
        EXPECT_EQ(visitor.hello().rate_millihertz, 60000U);
        std::uint32_t sequence = 0;
        std::int64_t last_us = -1;
        int triggers = 0;
        while (const auto message = visitor.next()) {
            if (message->kind == WorldMessageKind::kEnd) break;
            EXPECT_GE(message->time_us, last_us) << "the simulated clock never goes back";
            last_us = message->time_us;
            if (message->kind == WorldMessageKind::kLineEdge) {
                EXPECT_EQ(message->camera_or_line, static_cast<std::uint8_t>(WorldLine::kTrigger));
                triggers += message->active;
                continue;
            }
            ASSERT_EQ(message->kind, WorldMessageKind::kFrameSet);
            ASSERT_EQ(message->sequence, sequence);
            EXPECT_EQ(message->camera_mask, 3);
            EXPECT_EQ(message->time_us, 1'000'000 + std::llround(sequence * 1e6 / 60.0));
            EXPECT_EQ(digest_of(visitor, message->slot), expected_digest(sequence));
            visitor.say(WorldMessageKind::kSlotFree, message->slot);
            visitor.say(WorldMessageKind::kTickDone, 0, sequence++);
        }
        EXPECT_EQ(sequence, 20U);
        EXPECT_EQ(triggers, 20);
        visitor.hang_up();
        EXPECT_EQ(server.join(), ServerEnd::kCompleted);
        EXPECT_EQ(server.counters().sent, 20U);
        EXPECT_EQ(server.counters().dropped, 0U);
        EXPECT_EQ(server.counters().ignored, 0U);
    }
}

TEST_F(WorldServerTest, LockstepNeverSendsAheadOfTheTick) {
    WorldServer server(*world_, served(WorldPace::kLockstep));
    ASSERT_TRUE(server.listen());
    server.start();
    WorldVisitor visitor(folder_ / "world");
    ASSERT_TRUE(visitor.ok());
    while (visitor.next()->kind != WorldMessageKind::kFrameSet) {
    }
    visitor.say(WorldMessageKind::kSlotFree, 0);
    EXPECT_FALSE(visitor.next(200)) << "silent until kTickDone";
    visitor.say(WorldMessageKind::kTickDone, 0, 7);  // a tick that was never sent
    EXPECT_FALSE(visitor.next(200));
    visitor.say(WorldMessageKind::kTickDone, 0, 0);
    EXPECT_TRUE(visitor.next());
}

TEST_F(WorldServerTest, ControlsTakeEffectOnTheThirdFrameAfter) {
    for (const std::size_t threads : {1U, 2U}) {
        ServerConfig config = served(WorldPace::kLockstep);
        config.render_threads = threads;
        WorldServer server(*world_, config);
        ASSERT_TRUE(server.listen());
        server.start();
        WorldVisitor visitor(config.socket);
        ASSERT_TRUE(visitor.ok());
        while (const auto message = visitor.next()) {
            if (message->kind == WorldMessageKind::kEnd) break;
            if (message->kind != WorldMessageKind::kFrameSet) continue;
            const std::uint32_t k = message->sequence;
            const CameraControl control = k < 5 + 4 ? CameraControl{} : CameraControl{900.0F, 3.0F};
            EXPECT_EQ(digest_of(visitor, message->slot), expected_digest(k, control)) << k;
            if (k == 5) {
                for (std::uint8_t camera = 0; camera < 2; ++camera) {
                    WorldMessage set;
                    set.camera_or_line = camera;
                    set.kind = WorldMessageKind::kExposure;
                    set.value = 900.0F;
                    visitor.say(set);
                    set.kind = WorldMessageKind::kGain;
                    set.value = 3.0F;
                    visitor.say(set);
                }
            }
            visitor.say(WorldMessageKind::kSlotFree, message->slot);
            visitor.say(WorldMessageKind::kTickDone, 0, k);
        }
    }
}

TEST_F(WorldServerTest, ButtonsArePressedAndReleased) {
    ServerConfig config = served(WorldPace::kLockstep);
    config.presses = {{WorldLine::kButtonRecord, 150'000}, {WorldLine::kButtonNeutral, 20'000}};
    WorldServer server(*world_, config);
    ASSERT_TRUE(server.listen());
    server.start();
    WorldVisitor visitor(config.socket);
    ASSERT_TRUE(visitor.ok());
    std::map<int, std::vector<std::pair<int, std::int64_t>>> edges;
    while (const auto message = visitor.next()) {
        if (message->kind == WorldMessageKind::kEnd) break;
        if (message->kind == WorldMessageKind::kLineEdge) {
            edges[message->camera_or_line].push_back({message->active, message->time_us - 1'000'000});
        }
        if (message->kind != WorldMessageKind::kFrameSet) continue;
        visitor.say(WorldMessageKind::kSlotFree, message->slot);
        visitor.say(WorldMessageKind::kTickDone, 0, message->sequence);
    }
    using Edges = std::vector<std::pair<int, std::int64_t>>;
    EXPECT_EQ(edges[static_cast<int>(WorldLine::kButtonNeutral)], (Edges{{1, 20'000}, {0, 120'000}}));
    EXPECT_EQ(edges[static_cast<int>(WorldLine::kButtonRecord)], (Edges{{1, 150'000}, {0, 250'000}}));
}

TEST_F(WorldServerTest, ASlotIsNotWrittenWhileTheDaemonHoldsIt) {
    WorldServer server(*world_, served(WorldPace::kLockstep));
    ASSERT_TRUE(server.listen());
    server.start();
    WorldVisitor visitor(folder_ / "world");
    ASSERT_TRUE(visitor.ok());
    std::map<std::uint32_t, std::uint64_t> held;
    while (held.size() < 5) {  // every slot of the ring
        const auto message = visitor.next();
        ASSERT_TRUE(message);
        if (message->kind != WorldMessageKind::kFrameSet) continue;
        EXPECT_FALSE(held.contains(message->slot));
        held[message->slot] = digest_of(visitor, message->slot);
        visitor.say(WorldMessageKind::kTickDone, 0, message->sequence);
    }
    while (visitor.next(300)) {  // only the trigger's falling edge can come
    }
    for (const auto& [slot, digest] : held) EXPECT_EQ(digest_of(visitor, slot), digest);
    EXPECT_EQ(server.counters().sent, 5U);
    visitor.say(WorldMessageKind::kSlotFree, 2);
    const auto message = visitor.next();
    ASSERT_TRUE(message);
}

TEST_F(WorldServerTest, RealTimeKeepsTheBeatAndDropsWhenNoSlotIsFree) {
    ServerConfig config = served(WorldPace::kRealTime);
    WorldServer server(*world_, config);
    ASSERT_TRUE(server.listen());
    server.start();
    WorldVisitor visitor(config.socket);
    ASSERT_TRUE(visitor.ok());
    std::vector<WorldMessage> sets;
    std::size_t held = 0;
    while (const auto message = visitor.next()) {
        if (message->kind == WorldMessageKind::kEnd) break;
        if (message->kind != WorldMessageKind::kFrameSet) continue;
        EXPECT_GE(message->published_us, message->time_us) << "no frame before its exposure";
        sets.push_back(*message);
        // The daemon keeps the first frames for good; from then on one slot at most is left for the rest.
        if (held < 4) {
            ++held;
        } else {
            visitor.say(WorldMessageKind::kSlotFree, message->slot);
        }
    }
    visitor.hang_up();
    EXPECT_EQ(server.join(), ServerEnd::kCompleted);
    const bool overloaded = server.counters().overdue >= 15;  // of 20: sanitizers on a busy machine
    EXPECT_TRUE(overloaded || sets.size() >= 5);
    ASSERT_FALSE(sets.empty());
    for (const WorldMessage& set : sets) {
        EXPECT_NEAR(static_cast<double>(set.time_us - sets[0].time_us),
                    (set.sequence - sets[0].sequence) * 1e6 / 60.0, 1.0);
    }
    EXPECT_EQ(server.counters().sent, sets.size());
    EXPECT_EQ(server.counters().sent + server.counters().dropped, 20U);
    EXPECT_EQ(server.counters().no_slot + server.counters().overdue, server.counters().dropped);
}

TEST_F(WorldServerTest, RealTimeWithholdsFramesFromADaemonThatHoldsEverything) {
    ServerConfig config = served(WorldPace::kRealTime);
    WorldServer server(*world_, config);
    ASSERT_TRUE(server.listen());
    server.start();
    WorldVisitor visitor(config.socket);
    ASSERT_TRUE(visitor.ok());
    int sets = 0;
    while (const auto message = visitor.next()) {
        if (message->kind == WorldMessageKind::kEnd) break;
        sets += message->kind == WorldMessageKind::kFrameSet ? 1 : 0;
    }
    visitor.hang_up();
    EXPECT_EQ(server.join(), ServerEnd::kCompleted);
    EXPECT_LE(sets, 5);
    EXPECT_GE(server.counters().no_slot, 15U);
}

TEST_F(WorldServerTest, ADaemonThatHangsUpEndsTheVisit) {
    for (const WorldPace pace : {WorldPace::kLockstep, WorldPace::kRealTime}) {
        WorldServer server(*world_, served(pace));
        ASSERT_TRUE(server.listen());
        server.start();
        WorldVisitor visitor(folder_ / "world");
        ASSERT_TRUE(visitor.ok());
        while (visitor.next()->kind != WorldMessageKind::kFrameSet) {
        }
        visitor.hang_up();
        EXPECT_EQ(server.join(), ServerEnd::kDisconnected);
    }
}

TEST_F(WorldServerTest, StopEndsItAnywhere) {
    WorldServer waiting(*world_, served(WorldPace::kLockstep));
    ASSERT_TRUE(waiting.listen());
    waiting.start();
    waiting.stop();
    EXPECT_EQ(waiting.join(), ServerEnd::kStopped);

    ServerConfig config = served(WorldPace::kLockstep);
    config.socket = folder_ / "other";
    WorldServer visited(*world_, config);
    ASSERT_TRUE(visited.listen());
    visited.start();
    WorldVisitor visitor(config.socket);
    ASSERT_TRUE(visitor.ok());
    visited.stop();
    EXPECT_EQ(visited.join(), ServerEnd::kStopped);
}

TEST_F(WorldServerTest, NobodyComes) {
    ServerConfig config = served(WorldPace::kLockstep);
    config.connect_timeout_us = 50'000;
    WorldServer server(*world_, config);
    ASSERT_TRUE(server.listen());
    EXPECT_EQ(server.run(), ServerEnd::kNoDaemon);
}

TEST_F(WorldServerTest, NonsenseIsCountedAndIgnored) {
    WorldServer server(*world_, served(WorldPace::kLockstep));
    ASSERT_TRUE(server.listen());
    server.start();
    WorldVisitor visitor(folder_ / "world");
    ASSERT_TRUE(visitor.ok());
    std::optional<WorldMessage> message;
    while ((message = visitor.next())->kind != WorldMessageKind::kFrameSet) {
    }
    WorldMessage bad;
    bad.kind = static_cast<WorldMessageKind>(99);
    visitor.say(bad);
    bad.kind = WorldMessageKind::kFrameSet;
    visitor.say(bad);
    visitor.say(WorldMessageKind::kSlotFree, 4000000000U);
    bad.kind = WorldMessageKind::kExposure;
    bad.camera_or_line = 200;
    visitor.say(bad);
    bad.camera_or_line = 0;
    bad.value = std::numeric_limits<float>::quiet_NaN();
    visitor.say(bad);
    bad.kind = WorldMessageKind::kSetLine;
    bad.camera_or_line = 77;
    visitor.say(bad);
    bad.camera_or_line = static_cast<std::uint8_t>(WorldLine::kLed);
    visitor.say(bad);
    visitor.say(WorldMessageKind::kSlotFree, message->slot);
    visitor.say(WorldMessageKind::kSlotFree, message->slot);  // twice
    visitor.say(WorldMessageKind::kTickDone, 0, 0);
    ASSERT_TRUE(visitor.next()) << "the visit goes on";
    EXPECT_EQ(server.counters().ignored, 7U);
    EXPECT_EQ(server.counters().lines_set, 1U);
}

// The real other side, not this file's own idea of it.
TEST_F(WorldServerTest, TheDaemonsOwnClientSeesTheSamePictures) {
    WorldServer server(*world_, served(WorldPace::kLockstep));
    ASSERT_TRUE(server.listen());
    server.start();
    auto client = sim::WorldClient::connect((folder_ / "world").string());
    ASSERT_TRUE(client);
    for (std::size_t camera = 0; camera < 2; ++camera) ASSERT_TRUE((*client)->camera(camera).start());
    std::uint32_t frames = 0;
    while (true) {
        rig::test::Digest digest;
        bool complete = true;
        for (std::size_t camera = 0; camera < 2 && complete; ++camera) {
            auto frame = (*client)->camera(camera).wait_frame(std::int64_t{1} << 60);
            complete = frame.has_value();
            if (!complete) {
                EXPECT_EQ(frame.error(), FrameError::kEnded);
                continue;
            }
            EXPECT_EQ(frame->sequence, frames);
            digest.add(std::span<const std::uint8_t>(frame->image.pixels, world_->image_bytes()));
            (*client)->camera(camera).release(frame->token);
        }
        if (!complete) break;
        EXPECT_EQ(digest.value(), expected_digest(frames));
        ++frames;
        (*client)->tick_done();
    }
    EXPECT_EQ(frames, 20U);
    client->reset();
    EXPECT_EQ(server.join(), ServerEnd::kCompleted);
}

}  // namespace
}  // namespace rig::host
