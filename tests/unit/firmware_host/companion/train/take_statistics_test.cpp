#include "firmware_host/companion/train/take_statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace rig::host {
namespace {

// Shape 0: sleeps. Shape 1: a sine of period 60 frames about 0.5. Shape 2: one step per ten frames.
Take take_of(std::size_t frames, double rate_hz) {
    Take take;
    take.shape_names = {"asleep", "sine", "steps"};
    take.rate_hz = rate_hz;
    take.frame_count = frames;
    for (std::size_t f = 0; f < frames; ++f) {
        take.weights.push_back(0.0F);
        take.weights.push_back(0.5F +
                               0.4F * std::sin(static_cast<float>(f) * std::numbers::pi_v<float> / 30.0F));
        take.weights.push_back(f / 10 % 2 == 0 ? 0.25F : 0.75F);
    }
    return take;
}

TEST(WeightStatistics, DefaultsWithoutTakes) {
    const WeightStatistics statistics = weight_statistics({}, 2, 120.0);
    EXPECT_EQ(statistics.mean, std::vector<double>(2, kDefaultMean));
    EXPECT_EQ(statistics.sigma, std::vector<double>(2, kDefaultSigma));
    EXPECT_EQ(statistics.step, std::vector<double>(2, kDefaultStepAt60Hz / 2.0));
    const Take empty;
    EXPECT_EQ(weight_statistics(std::vector<Take>{empty}, 2, 120.0).mean, statistics.mean);
}

TEST(WeightStatistics, MeasuresMeanSpreadAndLivelySteps) {
    const std::vector<Take> takes{take_of(601, 60.0)};
    const WeightStatistics statistics = weight_statistics(takes, 3, 60.0);
    EXPECT_NEAR(statistics.mean[1], 0.5, 1e-3);
    EXPECT_NEAR(statistics.sigma[1], 0.4 / std::numbers::sqrt2, 1e-3);
    // The steepest tenth of a sine: nearly 0.4 * 2 pi / 60.
    EXPECT_NEAR(statistics.step[1], 0.4 * std::numbers::pi / 30.0, 5e-4);
    EXPECT_NEAR(statistics.mean[2], 0.5, 1e-3);
    EXPECT_NEAR(statistics.sigma[2], 0.25, 1e-3);
    EXPECT_NEAR(statistics.step[2], 0.5, 1e-6);  // every tenth frame is a step of 0.5
}

TEST(WeightStatistics, ASleepingShapeKeepsTheDefaults) {
    const std::vector<Take> takes{take_of(601, 60.0)};
    const WeightStatistics statistics = weight_statistics(takes, 3, 60.0);
    EXPECT_EQ(statistics.mean[0], kDefaultMean);
    EXPECT_EQ(statistics.sigma[0], kDefaultSigma);
    EXPECT_EQ(statistics.step[0], kDefaultStepAt60Hz);
}

TEST(WeightStatistics, ScalesStepsBetweenRates) {
    const std::vector<Take> slow{take_of(601, 30.0)};
    EXPECT_NEAR(weight_statistics(slow, 3, 60.0).step[1], 0.2 * std::numbers::pi / 30.0, 5e-4);
}

TEST(WeightStatistics, FramesOfDifferentTakesAreNoNeighbours) {
    Take low;
    low.shape_names = {"a"};
    low.frame_count = 10;
    low.weights.assign(10, 0.0F);
    Take high = low;
    high.weights.assign(10, 1.0F);
    const std::vector<Take> takes{low, high};
    const WeightStatistics statistics = weight_statistics(takes, 1, 60.0);
    EXPECT_EQ(statistics.mean[0], 0.5);
    EXPECT_EQ(statistics.sigma[0], 0.5);
    EXPECT_EQ(statistics.step[0], kLeastStepAt60Hz);
}

}  // namespace
}  // namespace rig::host
