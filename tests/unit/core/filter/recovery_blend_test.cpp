#include "core/filter/recovery_blend.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/random.hpp"

namespace rig {
namespace {

using test::SeededRandom;

constexpr std::int64_t kFrameUs = 16667;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
using Weights = std::array<double, 2>;

class RecoveryBlendTest : public testing::Test {
  protected:
    RecoveryBlendTest() {
        config_.low = low_;
        config_.high = high_;
    }
    // The caller's loss policy is "hold": what was sent last.
    Weights tick(bool good, const Weights& solved) {
        now_us_ += kFrameUs;
        const Weights held = sent_;
        blend_recovery(config_, good, solved, held, now_us_, state_, sent_, report_);
        return sent_;
    }
    void make_live(const Weights& at) {
        for (int i = 0; i < 60; ++i) tick(true, at);
        ASSERT_EQ(report_.phase, RecoveryPhase::kLive);
    }

    std::array<float, 2> low_{0.0F, -1.0F};
    std::array<float, 2> high_{1.0F, 1.0F};
    RecoveryConfig config_;
    RecoveryState state_;
    RecoveryReport report_;
    Weights sent_{};
    std::int64_t now_us_ = 0;
};

TEST_F(RecoveryBlendTest, HoldsUntilFiveGoodFramesInARow) {
    for (int i = 0; i < 4; ++i) EXPECT_EQ(tick(true, {1.0, 1.0}), (Weights{}));
    EXPECT_EQ(tick(false, {1.0, 1.0}), (Weights{}));
    for (int i = 0; i < 4; ++i) {
        EXPECT_EQ(tick(true, {1.0, 1.0}), (Weights{}));
        EXPECT_EQ(report_.phase, RecoveryPhase::kHeld);
        EXPECT_EQ(report_.remaining, 1.0);
    }
    tick(true, {1.0, 1.0});
    EXPECT_EQ(report_.phase, RecoveryPhase::kBlending);
}

TEST_F(RecoveryBlendTest, ArrivesAfterTheTimeTheSlewAllows) {
    // A gap of 1 at 5 per second and a steepest slope of 1.5: 0.3 s, 18 frames.
    int blending = 0;
    for (int i = 0; i < 60; ++i) {
        tick(true, {1.0, 0.2});
        blending += report_.phase == RecoveryPhase::kBlending ? 1 : 0;
    }
    EXPECT_EQ(report_.phase, RecoveryPhase::kLive);
    EXPECT_EQ(blending, 18);
    EXPECT_EQ(sent_, (Weights{1.0, 0.2}));
}

TEST_F(RecoveryBlendTest, NeverPops) {
    SeededRandom random(4);
    const double slew = config_.max_slew_per_s * static_cast<double>(kFrameUs) * 1e-6;
    Weights solved{0.3, -0.3};
    make_live(solved);
    for (int frame = 0; frame < 20000; ++frame) {
        const bool good = !random.chance(0.03);
        const Weights before_solved = solved;
        for (double& w : solved) w = std::clamp(w + random.normal(0.0, 0.05), 0.0, 1.0);
        const Weights before = sent_;
        const bool was_held = state_.phase == RecoveryPhase::kHeld;
        tick(good, solved);
        for (std::size_t i = 0; i < 2; ++i) {
            const double moved = std::fabs(sent_[i] - before[i]);
            const double face = was_held ? 0.0 : std::fabs(solved[i] - before_solved[i]);
            ASSERT_LE(moved, face + slew + 1e-12) << "frame " << frame << " good " << good;
        }
    }
}

TEST_F(RecoveryBlendTest, PassesThroughWhenLive) {
    make_live({0.5, 0.5});
    EXPECT_EQ(tick(true, {0.9, -0.9}), (Weights{0.9, -0.9}));
    EXPECT_EQ(report_.remaining, 0.0);
}

TEST_F(RecoveryBlendTest, StartsAgainWhenLostInTheMiddle) {
    make_live({0.0, 0.0});
    tick(false, {0.0, 0.0});
    for (int i = 0; i < 10; ++i) tick(true, {1.0, 1.0});
    ASSERT_EQ(report_.phase, RecoveryPhase::kBlending);
    const Weights middle = sent_;
    EXPECT_EQ(tick(false, {1.0, 1.0}), middle);
    EXPECT_EQ(report_.phase, RecoveryPhase::kHeld);
    for (int i = 0; i < 5; ++i) tick(true, {1.0, 1.0});
    EXPECT_EQ(report_.phase, RecoveryPhase::kBlending);
    EXPECT_EQ(sent_, middle) << "the new blend starts where the output is";
}

TEST_F(RecoveryBlendTest, FollowsADecayingHold) {
    make_live({0.8, 0.8});
    blend_recovery(config_, false, Weights{0.8, 0.8}, Weights{0.6, 0.5}, now_us_ + kFrameUs, state_, sent_,
                   report_);
    EXPECT_EQ(sent_, (Weights{0.6, 0.5}));
}

TEST_F(RecoveryBlendTest, NoGapNoBlend) {
    for (int i = 0; i < 5; ++i) tick(true, {0.0, 0.0});
    EXPECT_EQ(report_.phase, RecoveryPhase::kLive);
}

TEST_F(RecoveryBlendTest, BadNumbersAndTimesStayInRange) {
    SeededRandom random(5);
    const std::array wild{kNan, 1e300, -1e300, std::numeric_limits<double>::infinity(), 0.5};
    for (int frame = 0; frame < 20000; ++frame) {
        const auto pick = [&] { return wild[random.below(wild.size())]; };
        const Weights held{pick(), pick()};
        const std::int64_t at = random.chance(0.1) ? std::numeric_limits<std::int64_t>::min() : frame * 7;
        blend_recovery(config_, random.chance(0.9), Weights{pick(), pick()}, held, at, state_, sent_,
                       report_);
        ASSERT_TRUE(sent_[0] >= 0.0 && sent_[0] <= 1.0) << frame;
        ASSERT_TRUE(sent_[1] >= -1.0 && sent_[1] <= 1.0) << frame;
    }
}

TEST_F(RecoveryBlendTest, ResetForgets) {
    make_live({0.5, 0.5});
    reset_recovery(state_);
    EXPECT_EQ(state_.phase, RecoveryPhase::kHeld);
    EXPECT_EQ(state_.good_in_a_row, 0);
}

}  // namespace
}  // namespace rig
