#include "core/filter/one_euro.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "tests/support/random.hpp"

namespace rig {
namespace {

using test::SeededRandom;

constexpr std::int64_t kFrameUs = 16667;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// The published algorithm, written from the paper with its own names: Casiez 2012, algorithm 1.
class PaperOneEuro {
  public:
    PaperOneEuro(double mincutoff, double beta, double dcutoff)
        : mincutoff_(mincutoff), beta_(beta), dcutoff_(dcutoff) {}
    double filter(double x, double rate) {
        const double dx = first_ ? 0.0 : (x - hatxprev_) * rate;
        const double edx = first_ ? dx : lowpass(dx, dhatxprev_, alpha(rate, dcutoff_));
        const double cutoff = mincutoff_ + beta_ * std::fabs(edx);
        const double hatx = first_ ? x : lowpass(x, hatxprev_, alpha(rate, cutoff));
        first_ = false;
        hatxprev_ = hatx;
        dhatxprev_ = edx;
        return hatx;
    }

  private:
    static double alpha(double rate, double cutoff) {
        const double tau = 1.0 / (2.0 * std::numbers::pi * cutoff);
        const double te = 1.0 / rate;
        return 1.0 / (1.0 + tau / te);
    }
    static double lowpass(double x, double prev, double a) { return a * x + (1.0 - a) * prev; }

    double mincutoff_, beta_, dcutoff_;
    bool first_ = true;
    double hatxprev_ = 0.0;
    double dhatxprev_ = 0.0;
};

class OneEuroTest : public testing::Test {
  protected:
    OneEuroTest() {
        config_.low = low_;
        config_.high = high_;
    }
    std::array<double, 2> run(double a, double b, std::int64_t at_us) {
        std::array<double, 2> out{};
        filter_one_euro(config_, std::array{a, b}, at_us, state_, out, report_);
        return out;
    }

    std::array<float, 2> low_{0.0F, -1.0F};
    std::array<float, 2> high_{1.0F, 0.5F};
    OneEuroConfig config_;
    OneEuroState state_;
    OneEuroReport report_;
};

TEST_F(OneEuroTest, EqualsThePublishedAlgorithm) {
    SeededRandom random(1);
    PaperOneEuro first(config_.min_cutoff_hz, config_.beta, config_.derivative_cutoff_hz);
    PaperOneEuro second(config_.min_cutoff_hz, config_.beta, config_.derivative_cutoff_hz);
    double a = 0.5;
    double b = 0.0;
    std::int64_t now_us = 0;
    for (int frame = 0; frame < 5000; ++frame) {
        const auto dt_us =
            static_cast<std::int64_t>(random.uniform(5000.0, 60000.0));  // all within 0.25..4 frames
        now_us += dt_us;
        a = std::clamp(a + random.normal(0.0, 0.05), 0.0, 1.0);
        b = std::clamp(b + random.normal(0.0, 0.02), -1.0, 0.5);
        const auto out = run(a, b, now_us);
        const double rate = 1e6 / static_cast<double>(dt_us);
        ASSERT_NEAR(out[0], first.filter(a, rate), 1e-12) << frame;
        ASSERT_NEAR(out[1], second.filter(b, rate), 1e-12) << frame;
        ASSERT_FALSE(report_.interval_clamped);
    }
}

TEST_F(OneEuroTest, HandsTheFirstFrameOn) {
    EXPECT_EQ(run(0.7, -0.3, -5'000'000'000), (std::array{0.7, -0.3}));
    EXPECT_FALSE(report_.interval_clamped);
    run(0.0, 0.0, 0);
    reset_one_euro(state_);
    EXPECT_EQ(run(0.2, 0.1, 12345), (std::array{0.2, 0.1}));
}

TEST_F(OneEuroTest, CalmsNoiseAndFollowsMovement) {
    SeededRandom random(2);
    double noise_in = 0.0;
    double noise_out = 0.0;
    std::int64_t now_us = 0;
    for (int frame = 0; frame < 2000; ++frame, now_us += kFrameUs) {
        const double x = 0.5 + random.normal(0.0, 0.01);
        const double y = run(x, 0.0, now_us)[0];
        noise_in += (x - 0.5) * (x - 0.5);
        noise_out += (y - 0.5) * (y - 0.5);
    }
    EXPECT_LT(noise_out, 0.5 * noise_in);
    // A jump of 0.5 is within a tenth of itself after 100 ms.
    for (int frame = 0; frame < 6; ++frame, now_us += kFrameUs) run(1.0, 0.0, now_us);
    EXPECT_GT(run(1.0, 0.0, now_us)[0], 0.95);
}

TEST_F(OneEuroTest, ReportsAndSurvivesBadIntervals) {
    std::int64_t now_us = 1'000'000;
    run(0.0, 0.0, now_us);
    for (const std::int64_t step : {std::int64_t{0}, std::int64_t{-1'000'000}, std::int64_t{1},
                                    std::int64_t{10'000'000}, std::numeric_limits<std::int64_t>::max() / 2}) {
        now_us += step;
        const auto out = run(1.0, 0.5, now_us);
        EXPECT_TRUE(report_.interval_clamped) << step;
        EXPECT_EQ(state_.speed_per_s[0], 0.0);
        EXPECT_GE(out[0], 0.0);
        EXPECT_LE(out[0], 1.0);
    }
    run(1.0, 0.5, now_us + kFrameUs);
    EXPECT_FALSE(report_.interval_clamped);
}

TEST_F(OneEuroTest, RefusesWhatIsNotANumber) {
    EXPECT_EQ(run(kNan, kNan, 0), (std::array{0.0, 0.0}));
    EXPECT_EQ(report_.inputs_refused, 2);
    const auto before = run(0.6, -0.6, kFrameUs);
    const auto after = run(kNan, std::numeric_limits<double>::infinity(), 2 * kFrameUs);
    EXPECT_EQ(report_.inputs_refused, 2);
    EXPECT_EQ(after, before);
}

TEST_F(OneEuroTest, NeverLeavesTheRanges) {
    SeededRandom random(3);
    std::int64_t now_us = 0;
    const std::array wild{kNan, 1e300, -1e300, 1e-320,
                          0.0,  1.0,   -1.0,   std::numeric_limits<double>::infinity()};
    for (int frame = 0; frame < 20000; ++frame) {
        now_us += static_cast<std::int64_t>(random.uniform(-20000.0, 200000.0));
        const auto pick = [&] {
            return random.chance(0.3) ? wild[random.below(wild.size())] : random.uniform(-2.0, 2.0);
        };
        const auto out = run(pick(), pick(), now_us);
        ASSERT_TRUE(out[0] >= 0.0 && out[0] <= 1.0) << frame;
        ASSERT_TRUE(out[1] >= -1.0 && out[1] <= 0.5) << frame;
    }
}

TEST_F(OneEuroTest, WorksInPlace) {
    std::array<double, 2> values{0.4, 0.1};
    OneEuroState other;
    filter_one_euro(config_, values, 0, other, values, report_);
    values = {0.8, 0.2};
    filter_one_euro(config_, values, kFrameUs, other, values, report_);
    run(0.4, 0.1, 0);
    EXPECT_EQ(values, run(0.8, 0.2, kFrameUs));
}

}  // namespace
}  // namespace rig
