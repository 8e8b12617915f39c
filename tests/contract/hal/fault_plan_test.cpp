// Fault plans are carried out as written: each kind shows its fault while it lasts, and nothing before or
// after.
#include "hal/sim/fault_plan.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hal/sim/faulty_frame_source.hpp"
#include "hal/sim/faulty_link.hpp"
#include "hal/sim/loopback_link.hpp"
#include "hal/sim/manual_clock.hpp"
#include "hal/sim/memory_frame_source.hpp"

namespace rig::test {
namespace {

using sim::FaultEvent;
using sim::FaultKind;
using sim::FaultPlan;

TEST(FaultPlan, IsActiveForItsTimeAndTarget) {
    const FaultPlan plan{{{1000, FaultKind::kCameraGone, 500, 1, 0.0}}, 1};
    EXPECT_EQ(plan.active(FaultKind::kCameraGone, 1, 999), nullptr);
    EXPECT_NE(plan.active(FaultKind::kCameraGone, 1, 1000), nullptr);
    EXPECT_NE(plan.active(FaultKind::kCameraGone, 1, 1499), nullptr);
    EXPECT_EQ(plan.active(FaultKind::kCameraGone, 1, 1500), nullptr);
    EXPECT_EQ(plan.active(FaultKind::kCameraGone, 0, 1200), nullptr);
    EXPECT_EQ(plan.active(FaultKind::kCameraIo, 1, 1200), nullptr);
}

TEST(FaultPlan, TextIsRead) {
    const auto plan = sim::parse_fault_plan(
        "# a take\nseed 9\n\n2000 camera_gone 1500 0\n10 link_bit_errors 5 1 1e-4 # x\r\n");
    ASSERT_TRUE(plan.has_value());
    EXPECT_EQ(plan->seed, 9U);
    ASSERT_EQ(plan->events.size(), 2U);
    EXPECT_EQ(plan->events[0].at_us, 2'000'000);
    EXPECT_EQ(plan->events[0].what, FaultKind::kCameraGone);
    EXPECT_EQ(plan->events[0].for_us, 1'500'000);
    EXPECT_EQ(plan->events[1].target, 1);
    EXPECT_DOUBLE_EQ(plan->events[1].magnitude, 1e-4);
}

TEST(FaultPlan, BadTextNamesTheLine) {
    for (const char* bad :
         {"x camera_gone 1 0", "-1 camera_gone 1 0", "1 camera_lost 1 0", "1 camera_gone", "1 camera_gone 1",
          "1 camera_gone 1 999", "1 camera_gone 1 0 nan", "1 camera_gone 1 0 1 2", "seed", "seed -3",
          "99999999999999999999 camera_gone 1 0", "9223372036854775807 camera_gone 1 0"}) {
        const auto plan = sim::parse_fault_plan(std::string("1 camera_gone 1 0\n\n") + bad);
        ASSERT_FALSE(plan.has_value()) << bad;
        EXPECT_EQ(plan.error().line, 3) << bad;
        EXPECT_FALSE(plan.error().reason.empty());
    }
}

// 100 Hz; frame n has its mid-exposure at (n + 1) * 10 ms and pixels 4 * n.
class FaultyCamera : public testing::Test {
  protected:
    sim::ManualClock clock_;
    FaultPlan plan_;
    static sim::FramePacing pacing() { return {.rate_hz = 100.0}; }
    sim::SyntheticFrameSource inner_{clock_, 8, 6,
                                     [](std::uint32_t frame, std::span<std::uint8_t> pixels) {
                                         std::fill(pixels.begin(), pixels.end(),
                                                   static_cast<std::uint8_t>(4 * frame));
                                     },
                                     pacing()};
    sim::FaultyFrameSource camera_{inner_, clock_, plan_, 0};

    Result<CameraFrame, FrameError> next() { return camera_.wait_frame(clock_.now_us() + 15'000); }
    // Sequence number and first pixel of the next frame; fails the test when there is none.
    std::pair<std::uint32_t, int> next_pixel() {
        const auto frame = next();
        EXPECT_TRUE(frame.has_value());
        if (!frame) return {0, -1};
        const std::pair<std::uint32_t, int> result{frame->sequence, frame->image.row(5)[7]};
        camera_.release(frame->token);
        return result;
    }
    void plan(FaultKind what, int from_frame, int frames, double magnitude = 0.0) {
        plan_.events.push_back({(from_frame + 1) * 10'000, what, frames * 10'000, 0, magnitude});
        ASSERT_TRUE(camera_.start().has_value());
    }
};

TEST_F(FaultyCamera, GoneIsStickyUntilARestartAfterIt) {
    plan(FaultKind::kCameraGone, 2, 5);
    EXPECT_EQ(next_pixel().first, 0U);
    EXPECT_EQ(next_pixel().first, 1U);
    clock_.advance_to_us(30'000);
    EXPECT_EQ(next().error(), FrameError::kGone);
    EXPECT_EQ(camera_.start().error(), FrameError::kGone);
    EXPECT_EQ(next().error(), FrameError::kNotStarted);
    clock_.advance_to_us(80'000);
    ASSERT_TRUE(camera_.start().has_value());
    EXPECT_TRUE(next().has_value());
}

TEST_F(FaultyCamera, IoAndShortFramesAreErrorsOfOneFrame) {
    plan(FaultKind::kCameraIo, 1, 2);
    plan(FaultKind::kCameraShort, 3, 1);
    EXPECT_EQ(next_pixel().first, 0U);
    EXPECT_EQ(next().error(), FrameError::kIo);
    EXPECT_EQ(next().error(), FrameError::kIo);
    EXPECT_EQ(next().error(), FrameError::kShort);
    EXPECT_EQ(next_pixel(), (std::pair<std::uint32_t, int>{4, 16}));
}

TEST_F(FaultyCamera, SilenceIsATimeout) {
    plan(FaultKind::kCameraSilent, 1, 3);
    EXPECT_EQ(next_pixel().first, 0U);
    EXPECT_EQ(next().error(), FrameError::kTimeout);
    clock_.advance_to_us(48'000);
    EXPECT_EQ(next_pixel().first, 4U);
}

TEST_F(FaultyCamera, FrozenRepeatsThePictureUnderNewNumbers) {
    plan(FaultKind::kCameraFrozen, 2, 3);
    for (const auto& [sequence, pixel] : {std::pair{0, 0}, {1, 4}, {2, 8}, {3, 8}, {4, 8}, {5, 20}}) {
        EXPECT_EQ(next_pixel(), (std::pair<std::uint32_t, int>{sequence, pixel}));
    }
}

TEST_F(FaultyCamera, FlashAndDarkChangeThePicture) {
    plan(FaultKind::kExposureFlash, 1, 1, 250.0);
    plan(FaultKind::kExposureDark, 2, 1, 8.0);
    EXPECT_EQ(next_pixel().second, 0);
    EXPECT_EQ(next_pixel().second, 254);
    EXPECT_EQ(next_pixel().second, 1);
    EXPECT_EQ(next_pixel().second, 12);
}

TEST_F(FaultyCamera, ReorderDeliversTheNewerFirst) {
    plan(FaultKind::kCameraReorder, 1, 1);
    EXPECT_EQ(next_pixel().first, 0U);
    const auto newer = camera_.wait_frame(clock_.now_us() + 50'000);
    ASSERT_TRUE(newer.has_value());
    EXPECT_EQ(newer->sequence, 2U);
    const auto older = next();
    ASSERT_TRUE(older.has_value());
    EXPECT_EQ(older->sequence, 1U);
    EXPECT_LT(older->capture_us, newer->capture_us);
    camera_.release(newer->token);
    camera_.release(older->token);
    EXPECT_EQ(next_pixel().first, 3U);
}

TEST_F(FaultyCamera, LateFramesComeLate) {
    plan(FaultKind::kCameraLate, 1, 1, 25'000.0);
    EXPECT_EQ(next_pixel().first, 0U);
    EXPECT_EQ(next().error(), FrameError::kTimeout);
    const auto late = camera_.wait_frame(clock_.now_us() + 50'000);
    ASSERT_TRUE(late.has_value());
    EXPECT_EQ(late->sequence, 1U);
    EXPECT_EQ(clock_.now_us() - late->capture_us, 25'000);
}

class FaultyLinkTest : public testing::Test {
  protected:
    sim::ManualClock clock_;
    FaultPlan plan_;
    sim::LoopbackPair pair_{1 << 20, sim::LoopbackKind::kStream};
    sim::FaultyLink link_{pair_.near_end(), clock_, plan_, 2};

    void plan(FaultKind what, double magnitude = 0.0) {
        plan_.events.push_back({1000, what, 1000, 2, magnitude});
        ASSERT_TRUE(link_.open());
        ASSERT_TRUE(pair_.far_end().open());
        clock_.advance_to_us(1000);
    }
    std::vector<std::byte> received() {
        std::vector<std::byte> bytes(1 << 20);
        bytes.resize(pair_.far_end().read(bytes).value());
        return bytes;
    }
};

TEST_F(FaultyLinkTest, StallTakesAndGivesNothing) {
    plan(FaultKind::kLinkStall);
    std::vector<std::byte> bytes(10);
    EXPECT_EQ(link_.write(bytes).value(), 0U);
    ASSERT_EQ(pair_.far_end().write(bytes).value(), 10U);
    EXPECT_EQ(link_.read(bytes).value(), 0U);
    clock_.advance_to_us(2000);
    EXPECT_EQ(link_.read(bytes).value(), 10U);
    EXPECT_EQ(link_.write(bytes).value(), 10U);
}

TEST_F(FaultyLinkTest, ResetIsClosedUntilReopenedAfterIt) {
    plan(FaultKind::kLinkReset);
    std::vector<std::byte> bytes(10);
    EXPECT_EQ(link_.write(bytes).error(), LinkError::kClosed);
    EXPECT_EQ(link_.open().error(), LinkError::kOpen);
    clock_.advance_to_us(2000);
    EXPECT_EQ(link_.write(bytes).error(), LinkError::kClosed);
    ASSERT_TRUE(link_.open());
    EXPECT_EQ(link_.write(bytes).value(), 10U);
}

TEST_F(FaultyLinkTest, BitErrorsHaveTheirRateAndSeed) {
    plan(FaultKind::kLinkBitErrors, 1e-3);
    const std::vector<std::byte> zeros(1000);
    std::uint64_t flipped = 0;
    for (int i = 0; i < 200; ++i) {
        ASSERT_EQ(link_.write(zeros).value(), zeros.size());
        for (const std::byte b : received())
            flipped += static_cast<std::uint64_t>(std::popcount(std::to_integer<unsigned>(b)));
    }
    EXPECT_EQ(flipped, link_.flipped_bits());
    // 1.6e6 bits at 1e-3: 1600 with a standard deviation of 40.
    EXPECT_NEAR(static_cast<double>(flipped), 1600.0, 200.0);
}

TEST_F(FaultyLinkTest, ByteLossIsInvisibleToTheWriter) {
    plan(FaultKind::kLinkByteLoss, 0.1);
    const std::vector<std::byte> bytes(10'000, std::byte{1});
    ASSERT_EQ(link_.write(bytes).value(), bytes.size());
    EXPECT_EQ(received().size() + link_.lost_bytes(), bytes.size());
    EXPECT_NEAR(static_cast<double>(link_.lost_bytes()), 1000.0, 150.0);
}

TEST_F(FaultyLinkTest, PartialTakesAFewBytesAtATime) {
    plan(FaultKind::kLinkPartial, 3.0);
    const std::vector<std::byte> bytes(10);
    EXPECT_EQ(link_.write(bytes).value(), 3U);
}

TEST(LoopbackPairTest, UnpluggingClosesBothEnds) {
    sim::LoopbackPair pair(64, sim::LoopbackKind::kStream);
    ASSERT_TRUE(pair.near_end().open());
    ASSERT_TRUE(pair.far_end().open());
    std::vector<std::byte> bytes(4);
    ASSERT_EQ(pair.near_end().write(bytes).value(), 4U);
    pair.unplug();
    EXPECT_EQ(pair.near_end().write(bytes).error(), LinkError::kClosed);
    EXPECT_EQ(pair.far_end().read(bytes).error(), LinkError::kClosed);
    EXPECT_EQ(pair.near_end().open().error(), LinkError::kOpen);
    pair.plug_in();
    ASSERT_TRUE(pair.near_end().open());
    ASSERT_TRUE(pair.far_end().open());
    EXPECT_EQ(pair.far_end().read(bytes).value(), 0U);  // what was under way is lost
}

}  // namespace
}  // namespace rig::test
