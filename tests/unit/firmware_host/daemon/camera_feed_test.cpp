// A camera that fails in every way that its interface knows, and what the tick loop gets of it.
#include "firmware_host/daemon/camera_feed.hpp"

#include <gtest/gtest.h>

#include <array>
#include <deque>

#include "hal/sim/manual_clock.hpp"

namespace rig::test {
namespace {

// Plays what the test has put down; each answer takes 10 ms.
class ScriptedCamera final : public FrameSource {
  public:
    explicit ScriptedCamera(sim::ManualClock& clock) : clock_(clock) {}
    Result<FrameFormat, FrameError> start() override {
        ++starts;
        if (!start_errors.empty()) {
            const FrameError error = start_errors.front();
            start_errors.pop_front();
            return failure(error);
        }
        return FrameFormat{8, 1, 100.0};
    }
    void stop() override {}
    Result<CameraFrame, FrameError> wait_frame(std::int64_t) override {
        clock_.advance_by_us(10'000);
        if (script.empty()) return failure(FrameError::kTimeout);
        const auto next = script.front();
        script.pop_front();
        if (!next) return failure(next.error());
        for (std::uint8_t& pixel : pixels_) pixel = static_cast<std::uint8_t>(pixel + 7);
        CameraFrame frame;
        frame.image = {pixels_.data(), 8, 1, 8};
        frame.capture_us = clock_.now_us();
        frame.sequence = *next;
        return frame;
    }
    void release(std::uint32_t) override {}
    int borrow_limit() const override { return 3; }
    Result<void, FrameError> set_exposure_us(std::int32_t) override { return {}; }
    Result<void, FrameError> set_gain_db(float) override { return {}; }

    std::deque<Result<std::uint32_t, FrameError>> script;  // sequence numbers or errors
    std::deque<FrameError> start_errors;
    int starts = 0;

  private:
    sim::ManualClock& clock_;
    std::array<std::uint8_t, 8> pixels_{20, 40, 60, 80, 100, 120, 140, 160};
};

class CameraFeedTest : public testing::Test {
  protected:
    sim::ManualClock clock_{1'000'000};
    ScriptedCamera camera_{clock_};
    CameraFeed feed_{camera_, clock_, CameraFeedConfig{}};

    bool takes() {
        const auto frame = feed_.take(clock_.now_us() + 15'000);
        if (frame) feed_.release(*frame);
        return frame.has_value();
    }
};

TEST_F(CameraFeedTest, DiscardedFramesAreFaultsAndTheNextOneIsTaken) {
    const std::array<std::pair<FrameError, Fault>, 4> discarded{
        {{FrameError::kShort, Fault::kShortFrame},
         {FrameError::kFormat, Fault::kFormatChanged},
         {FrameError::kDamaged, Fault::kBufferError},
         {FrameError::kCorrupt, Fault::kCorruptJpeg}}};
    ASSERT_TRUE(feed_.open().has_value());
    std::uint32_t sequence = 0;
    for (const auto& [error, fault] : discarded) {
        camera_.script = {failure(error), sequence++};
        EXPECT_TRUE(takes());
        EXPECT_EQ(feed_.take_faults(), fault_bit(fault));
        EXPECT_EQ(feed_.status(), CameraStatus::kGood);
    }
    EXPECT_EQ(camera_.starts, 1);
}

TEST_F(CameraFeedTest, GapsAreCountedWithinAStartOnly) {
    ASSERT_TRUE(feed_.open().has_value());
    camera_.script = {std::uint32_t{5}, std::uint32_t{6}, std::uint32_t{9}};
    EXPECT_TRUE(takes() && takes());
    EXPECT_EQ(feed_.take_faults(), 0U);
    EXPECT_TRUE(takes());
    EXPECT_EQ(feed_.take_faults(), fault_bit(Fault::kSequenceGap));
    camera_.script = {failure(FrameError::kGone)};
    EXPECT_FALSE(takes());
    EXPECT_EQ(feed_.status(), CameraStatus::kGone);
    clock_.advance_by_us(300'000);
    camera_.script = {std::uint32_t{0}, std::uint32_t{1}};
    EXPECT_TRUE(takes() && takes());
    EXPECT_EQ(feed_.take_faults(), 0U) << "a camera that came back counts from 0";
    EXPECT_EQ(camera_.starts, 2);
}

TEST_F(CameraFeedTest, AnotherCameraInItsPlaceIsSaid) {
    camera_.start_errors = {FrameError::kIdentity};
    EXPECT_FALSE(feed_.open().has_value());
    EXPECT_EQ(feed_.take_faults(), fault_bit(Fault::kCameraIdentity));
    EXPECT_EQ(feed_.status(), CameraStatus::kGone);
}

TEST_F(CameraFeedTest, ACameraThatIsNotThereIsTriedLessAndLessOften) {
    camera_.start_errors.assign(100, FrameError::kGone);
    EXPECT_FALSE(feed_.open().has_value());
    for (int i = 0; i < 900; ++i) {  // 9 s
        EXPECT_FALSE(takes());
        clock_.advance_by_us(10'000);
    }
    // At 0.25, 0.75, 1.75, 3.75, 5.75, 7.75 s.
    EXPECT_EQ(camera_.starts, 1 + 6);
}

}  // namespace
}  // namespace rig::test
