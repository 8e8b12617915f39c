// The daemon in real time, threads and all. What is promised here must hold on a busy machine too, so nothing
// is said about how long things take.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "hal/linux/monotonic_clock.hpp"
#include "tests/sim/daemon/daemon_bench.hpp"
#include "tests/sim/daemon/painted_take.hpp"

namespace rig::test {
namespace {

// Pictures are painted beforehand: painting costs more than a frame's time in a sanitizer build.
std::vector<std::vector<std::uint8_t>> pictures(std::size_t camera, std::uint32_t count) {
    const PaintedTake& take = painted_take();
    std::vector<std::vector<std::uint8_t>> images(count);
    for (std::uint32_t f = 0; f < count; ++f) {
        images[f].resize(static_cast<std::size_t>(take.width_px()) *
                         static_cast<std::size_t>(take.height_px()));
        take.paint(camera, f, images[f]);
    }
    return images;
}

class DaemonThreads : public testing::Test {
  protected:
    static constexpr std::uint32_t kFrames = 40;
    static constexpr double kRate_hz = 30.0;

    void start(std::size_t capacity) {
        pair_ = std::make_unique<sim::LoopbackPair>(capacity, sim::LoopbackKind::kStream);
        ASSERT_TRUE(pair_->near_end().open());
        host_ = std::make_unique<TestHost>(pair_->far_end());
        const PaintedTake& take = painted_take();
        AppParts parts{clock_,  clock_,  {},         pair_->near_end(), watchdog_, pace_,
                       nullptr, nullptr, *pipeline_, &take.pack(),      nullptr};
        for (std::size_t c = 0; c < 2; ++c) {
            sim::FramePacing pacing;
            pacing.rate_hz = kRate_hz;
            pacing.frame_total = kFrames;
            cameras_.push_back(std::make_unique<sim::ReplayFrameSource>(
                clock_, take.width_px(), take.height_px(), pictures(c, kFrames), pacing));
            parts.cameras.push_back(cameras_[c].get());
        }
        PipelineConfig pipeline;
        pipeline.rate_hz = kRate_hz;
        ASSERT_TRUE(pipeline_->configure(take.pack(), pipeline));
        AppConfig config;
        config.rate_hz = kRate_hz;
        config.identity.first_streams.mask = kAllStreams;
        app_ = std::make_unique<App>(parts, config);
        app_->open_cameras();
    }

    MonotonicClock clock_;
    sim::MemoryWatchdog watchdog_{clock_, 60'000'000};
    Pace pace_;
    std::unique_ptr<Pipeline> pipeline_ = std::make_unique<Pipeline>();
    std::vector<std::unique_ptr<sim::ReplayFrameSource>> cameras_;
    std::unique_ptr<sim::LoopbackPair> pair_;
    std::unique_ptr<TestHost> host_;
    std::unique_ptr<App> app_;
    std::atomic<bool> stop_{false};
};

TEST_F(DaemonThreads, AReadingHostGetsStatesInOrderAndAGoodbye) {
    start(1 << 16);
    std::atomic<bool> done{false};
    std::thread reader([&] {
        while (!done) {
            host_->read();
            clock_.sleep_until_us(clock_.now_us() + 1000);
        }
        host_->read();
    });
    EXPECT_EQ(app_->run_threads(stop_, [] {}, [] {}), AppEnd::kWorldEnded);
    done = true;
    reader.join();
    const Health health = app_->health();
    ASSERT_FALSE(host_->states.empty());
    for (std::size_t i = 1; i < host_->states.size(); ++i) {
        EXPECT_GT(host_->states[i].sequence, host_->states[i - 1].sequence);
    }
    EXPECT_EQ(host_->counters().bad(), 0U);
    EXPECT_EQ(host_->count(MessageType::kGoodbye), 1U);
    EXPECT_EQ(health.ticks, health.frames_sent + health.frames_dropped);
    EXPECT_EQ(host_->states.size(), health.frames_sent);
    EXPECT_GE(health.ticks, 2U);
    EXPECT_GT(health.camera_good[0], 0U);
    EXPECT_GT(health.camera_good[1], 0U);
}

TEST_F(DaemonThreads, AHostThatNeverReadsStopsNothing) {
    start(100);  // less than one state
    EXPECT_EQ(app_->run_threads(stop_, [] {}, [] {}), AppEnd::kWorldEnded);
    const Health health = app_->health();
    EXPECT_EQ(health.frames_sent, 0U);
    EXPECT_GE(health.ticks, 1U);
    EXPECT_GE(health.frames_dropped + 2, health.ticks);  // one is under way for ever, one waits
    EXPECT_GT(health.camera_good[0], 0U);
}

TEST_F(DaemonThreads, StopEndsEveryThread) {
    start(1 << 16);
    std::thread stopper([&] {
        clock_.sleep_until_us(clock_.now_us() + 300'000);
        stop_ = true;
        clock_.interrupt();
    });
    EXPECT_EQ(app_->run_threads(stop_, [] {}, [] {}), AppEnd::kStopped);
    stopper.join();
    host_->read();
    EXPECT_EQ(host_->count(MessageType::kGoodbye), 1U);
}

}  // namespace
}  // namespace rig::test
