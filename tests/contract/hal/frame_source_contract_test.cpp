// The contract of hal/frame_source.hpp, on every backend.
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <array>
#include <memory>
#include <set>

#include "hal/linux/v4l2/v4l2_frame_source.hpp"
#include "hal/sim/fault_plan.hpp"
#include "hal/sim/faulty_frame_source.hpp"
#include "hal/sim/manual_clock.hpp"
#include "hal/sim/memory_frame_source.hpp"
#include "hal/sim/world_client.hpp"
#include "tests/contract/hal/fake_camera.hpp"
#include "tests/contract/hal/fake_world.hpp"

namespace rig::test {
namespace {

constexpr std::uint32_t kFrames = 12;
constexpr std::int64_t kPeriod_us = 10'000;

// A camera of 8x6 px at 100 Hz that delivers kFrames frames and ends; every pixel of a frame has one value,
// and consecutive frames differ.
class FrameBench {
  public:
    virtual ~FrameBench() = default;
    [[nodiscard]] virtual FrameSource& source() = 0;
    [[nodiscard]] virtual Clock& clock() = 0;
    virtual void frame_done() {}  // what the tick loop does between frames
    [[nodiscard]] virtual bool may_restart() const { return true; }
    // What follows the last frame: a camera has no end.
    [[nodiscard]] virtual FrameError after_the_last() const { return FrameError::kEnded; }
};

sim::FramePacing pacing() {
    sim::FramePacing result;
    result.rate_hz = 100.0;
    result.frame_total = kFrames;
    return result;
}

class ReplayBench : public FrameBench {
  public:
    FrameSource& source() override { return source_; }
    Clock& clock() override { return clock_; }

  private:
    static std::vector<std::vector<std::uint8_t>> images() {
        return {std::vector<std::uint8_t>(48, 10), std::vector<std::uint8_t>(48, 20),
                std::vector<std::uint8_t>(48, 30)};
    }
    sim::ManualClock clock_;
    sim::ReplayFrameSource source_{clock_, 8, 6, images(), pacing()};
};

class SyntheticBench final : public FrameBench {
  public:
    FrameSource& source() override { return source_; }
    Clock& clock() override { return clock_; }

  private:
    sim::ManualClock clock_{7'000'000};
    sim::SyntheticFrameSource source_{clock_, 8, 6,
                                      [](std::uint32_t frame, std::span<std::uint8_t> pixels) {
                                          std::fill(pixels.begin(), pixels.end(),
                                                    static_cast<std::uint8_t>(frame));
                                      },
                                      pacing()};
};

class FaultlessBench final : public FrameBench {
  public:
    FrameSource& source() override { return source_; }
    Clock& clock() override { return inner_.clock(); }

  private:
    ReplayBench inner_;
    sim::FaultPlan plan_;
    sim::FaultyFrameSource source_{inner_.source(), inner_.clock(), plan_, 0};
};

class WorldBench final : public FrameBench {
  public:
    explicit WorldBench(sim::WorldPace pace) : world_(pace) {
        world_.perform(kFrames);
        client_ = std::move(*sim::WorldClient::connect(world_.path()));
    }
    FrameSource& source() override { return client_->camera(1); }
    Clock& clock() override { return client_->clock(); }
    void frame_done() override { client_->tick_done(); }
    bool may_restart() const override { return false; }

  private:
    FakeWorld world_;
    std::unique_ptr<sim::WorldClient> client_;
};

// A camera behind a driver that this program pretends to be.
class V4l2Bench final : public FrameBench {
  public:
    explicit V4l2Bench(PixelLayout layout) {
        FakeSensor sensor;
        sensor.layouts = {layout};
        sensor.row_bytes = 20;
        sensor.frame_total = kFrames;
        sensor.controls = {{V4L2_CID_EXPOSURE_ABSOLUTE, {1, 500}}, {V4L2_CID_GAIN, {0, 100}}};
        const int pixel_bytes = bytes_per_pixel(layout);
        sensor.picture = [=](std::uint32_t n) {
            std::vector<std::uint8_t> bytes(20 * 6, 0xEE);
            for (std::size_t y = 0; y < 6; ++y) {
                for (std::size_t x = 0; x < 8; ++x)
                    bytes[20 * y + x * static_cast<std::size_t>(pixel_bytes)] = static_cast<std::uint8_t>(n);
            }
            return bytes;
        };
        machine_.plug_in(2, "1-2.1", "A17", sensor);
        V4l2CameraConfig config;
        config.width_px = 8;
        config.height_px = 6;
        config.rate_hz = 100.0;
        config.gain.unit_db = 0.5;
        config.tree = machine_.tree();
        source_ = std::make_unique<V4l2FrameSource>(clock_, config);
    }
    FrameSource& source() override { return *source_; }
    Clock& clock() override { return clock_; }
    [[nodiscard]] FrameError after_the_last() const override { return FrameError::kTimeout; }

  private:
    sim::ManualClock clock_{3'000'000};
    FakeVideoMachine machine_{clock_};
    std::unique_ptr<V4l2FrameSource> source_;
};

struct FrameBackend {
    const char* name;
    std::unique_ptr<FrameBench> (*make)();
};

class FrameSourceContract : public testing::TestWithParam<FrameBackend> {
  protected:
    std::unique_ptr<FrameBench> bench_ = GetParam().make();
    FrameSource& source_ = bench_->source();

    Result<CameraFrame, FrameError> next_frame() {
        return source_.wait_frame(bench_->clock().now_us() + 100 * kPeriod_us);
    }
};

TEST_P(FrameSourceContract, NothingBeforeStart) {
    EXPECT_EQ(next_frame().error(), FrameError::kNotStarted);
}

TEST_P(FrameSourceContract, StartTellsTheFormat) {
    const auto format = source_.start();
    ASSERT_TRUE(format.has_value());
    EXPECT_EQ(format->width_px, 8);
    EXPECT_EQ(format->height_px, 6);
    EXPECT_DOUBLE_EQ(format->rate_hz, 100.0);
}

TEST_P(FrameSourceContract, FramesComeInOrderAndThenTheEnd) {
    ASSERT_TRUE(source_.start().has_value());
    CameraFrame last;
    last.capture_us = -1;
    int frames = 0;
    while (true) {
        const auto frame = next_frame();
        if (!frame) {
            EXPECT_EQ(frame.error(), bench_->after_the_last());
            break;
        }
        EXPECT_GT(frame->capture_us, last.capture_us);
        if (frames > 0) {
            EXPECT_EQ(frame->capture_us - last.capture_us, kPeriod_us * (frame->sequence - last.sequence));
        }
        last = *frame;
        ++frames;
        source_.release(frame->token);
        bench_->frame_done();
    }
    // A source in real time may lose frames to a busy machine; one in simulated time may not.
    const bool real_time = std::string(GetParam().name) == "WorldRealTime";
    EXPECT_GE(frames, real_time ? 3 : static_cast<int>(kFrames));
    EXPECT_LE(frames, static_cast<int>(kFrames));
    EXPECT_EQ(next_frame().error(), bench_->after_the_last());
}

TEST_P(FrameSourceContract, PixelsStayUntilReleased) {
    ASSERT_TRUE(source_.start().has_value());
    const int borrowed = std::min(source_.borrow_limit(), 3);
    std::vector<CameraFrame> frames;
    std::vector<std::uint8_t> values;
    for (int i = 0; i < borrowed; ++i) {
        const auto frame = next_frame();
        ASSERT_TRUE(frame.has_value());
        frames.push_back(*frame);
        values.push_back(frame->image.row(0)[0]);
        if (i + 1 < borrowed) bench_->frame_done();
    }
    EXPECT_EQ(std::set<std::uint8_t>(values.begin(), values.end()).size(), values.size());
    for (std::size_t i = 0; i < frames.size(); ++i) {
        ASSERT_EQ(frames[i].image.width_px, 8);
        ASSERT_EQ(frames[i].image.height_px, 6);
        for (int y = 0; y < 6; ++y) {
            for (int x = 0; x < 8; ++x) ASSERT_EQ(frames[i].image.row(y)[x], values[i]);
        }
    }
    // In another order than they came.
    for (auto frame = frames.rbegin(); frame != frames.rend(); ++frame) source_.release(frame->token);
    bench_->frame_done();
    EXPECT_TRUE(next_frame().has_value());
}

TEST_P(FrameSourceContract, DeadlineIsKept) {
    ASSERT_TRUE(source_.start().has_value());
    const std::int64_t now_us = bench_->clock().now_us();
    const auto frame = source_.wait_frame(now_us);  // has passed: whatever is not there yet does not come
    if (frame) {
        source_.release(frame->token);
    } else {
        EXPECT_EQ(frame.error(), FrameError::kTimeout);
    }
}

TEST_P(FrameSourceContract, StopIsIdempotentAndEndsBorrowing) {
    source_.stop();
    ASSERT_TRUE(source_.start().has_value());
    const auto frame = next_frame();
    ASSERT_TRUE(frame.has_value());
    source_.stop();
    source_.stop();
    EXPECT_EQ(next_frame().error(), FrameError::kNotStarted);
    bench_->frame_done();
    ASSERT_TRUE(source_.start().has_value());
    const auto again = next_frame();
    ASSERT_TRUE(again.has_value());
    source_.release(again->token);
}

TEST_P(FrameSourceContract, ControlsHaveRanges) {
    ASSERT_TRUE(source_.start().has_value());
    EXPECT_TRUE(source_.set_exposure_us(2000).has_value());
    EXPECT_EQ(source_.set_exposure_us(0).error(), FrameError::kRefused);
    EXPECT_EQ(source_.set_exposure_us(-5).error(), FrameError::kRefused);
    EXPECT_EQ(source_.set_exposure_us(20'000).error(), FrameError::kRefused);  // longer than a period
    EXPECT_TRUE(source_.set_gain_db(6.0F).has_value());
    EXPECT_EQ(source_.set_gain_db(-1.0F).error(), FrameError::kRefused);
    EXPECT_EQ(source_.set_gain_db(1000.0F).error(), FrameError::kRefused);
    EXPECT_EQ(source_.set_gain_db(std::numeric_limits<float>::quiet_NaN()).error(), FrameError::kRefused);
}

INSTANTIATE_TEST_SUITE_P(
    Backends, FrameSourceContract,
    testing::Values(
        FrameBackend{"Replay",
                     []() -> std::unique_ptr<FrameBench> { return std::make_unique<ReplayBench>(); }},
        FrameBackend{"Synthetic",
                     []() -> std::unique_ptr<FrameBench> { return std::make_unique<SyntheticBench>(); }},
        FrameBackend{"FaultlessFaulty",
                     []() -> std::unique_ptr<FrameBench> { return std::make_unique<FaultlessBench>(); }},
        FrameBackend{
            "V4l2Grey",
            []() -> std::unique_ptr<FrameBench> { return std::make_unique<V4l2Bench>(PixelLayout::kGrey); }},
        FrameBackend{
            "V4l2Yuyv",
            []() -> std::unique_ptr<FrameBench> { return std::make_unique<V4l2Bench>(PixelLayout::kYuyv); }},
        FrameBackend{"WorldLockstep",
                     []() -> std::unique_ptr<FrameBench> {
                         return std::make_unique<WorldBench>(sim::WorldPace::kLockstep);
                     }},
        FrameBackend{"WorldRealTime",
                     []() -> std::unique_ptr<FrameBench> {
                         return std::make_unique<WorldBench>(sim::WorldPace::kRealTime);
                     }}),
    [](const auto& backend) { return std::string(backend.param.name); });

}  // namespace
}  // namespace rig::test
