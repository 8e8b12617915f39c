#include "firmware_host/companion/fit/marker_noise.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "firmware_host/companion/train/train.hpp"
#include "tests/unit/firmware_host/companion/fit/fit_scene.hpp"

namespace rig::host {
namespace {

using test::SeededRandom;

// A marker whose coordinates have noise of their own, standing still or swinging 10 mm at 2 Hz.
MarkerTake noisy_take(const Vec3& sigma_mm, bool swings, std::size_t frames) {
    SeededRandom random(3);
    MarkerTake take{.frame_count = frames, .marker_count = 2, .rate_hz = 60.0, .positions_mm = {}};
    for (std::size_t f = 0; f < frames; ++f) {
        const double swing =
            swings ? 10.0 * std::sin(2.0 * std::numbers::pi * 2.0 * static_cast<double>(f) / 60.0) : 0.0;
        for (int k = 0; k < 2; ++k) {
            take.positions_mm.emplace_back(swing + random.normal(0.0, sigma_mm[0]),
                                           50.0 - swing + random.normal(0.0, sigma_mm[1]),
                                           random.normal(0.0, sigma_mm[2]));
        }
    }
    return take;
}

TEST(NoiseOfHold, IsTheSpreadAboutTheMean) {
    const Vec3 sigma(0.05, 0.1, 0.3);
    const CoordinateNoise noise = noise_of_hold(noisy_take(sigma, false, 2000), 0, 2000);
    EXPECT_EQ(noise.markers, 2U);
    for (Eigen::Index a = 0; a < 3; ++a) EXPECT_NEAR(noise.sigma_mm[1][a], sigma[a], 0.06 * sigma[a]);
    EXPECT_NEAR(noise.pooled_mm, std::sqrt(sigma.squaredNorm() / 3.0), 0.01);
}

TEST(NoiseOfHold, NeedsEnoughFrames) {
    const MarkerTake take = noisy_take(Vec3::Constant(0.1), false, 100);
    EXPECT_EQ(noise_of_hold(take, 0, kLeastNoiseSamples - 1).markers, 0U);
    EXPECT_EQ(noise_of_hold(take, 0, kLeastNoiseSamples).markers, 2U);
    EXPECT_EQ(noise_of_hold(take, 90, 5000).markers, 0U);
    EXPECT_EQ(noise_of_hold(take, 500, 600).pooled_mm, 0.0);
}

TEST(NoiseOfDifferences, SeesNoiseThroughMotion) {
    for (const double sigma : {0.03, 0.1, 0.4}) {
        const CoordinateNoise noise = noise_of_differences(noisy_take(Vec3::Constant(sigma), true, 3000));
        ASSERT_EQ(noise.markers, 2U);
        EXPECT_NEAR(noise.pooled_mm, sigma, 0.06 * sigma) << sigma;
    }
}

TEST(NoiseOfDifferences, KeepsCoordinatesAndHiddenMarkersApart) {
    MarkerTake take = noisy_take({0.05, 0.1, 0.3}, true, 3000);
    for (std::size_t f = 0; f < take.frame_count; ++f) {
        if (f % 4 == 0) take.positions_mm[2 * f] = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
    }
    const CoordinateNoise noise = noise_of_differences(take);
    EXPECT_EQ(noise.markers, 1U);
    EXPECT_EQ(noise.sigma_mm[0], Vec3::Zero());  // never five frames in a row
    EXPECT_NEAR(noise.sigma_mm[1][0], 0.05, 0.006);
    EXPECT_NEAR(noise.sigma_mm[1][2], 0.3, 0.02);
}

TEST(NoiseOfDifferences, IsNothingForAShortTake) {
    EXPECT_EQ(noise_of_differences(noisy_take(Vec3::Constant(0.1), false, 4)).markers, 0U);
    EXPECT_EQ(noise_of_differences(noisy_take(Vec3::Constant(0.1), false, 1)).pooled_mm, 0.0);
}

TEST(NoiseOfResidual, TakesTheDegreesOfFreedomOff) {
    test::FitSceneOptions options;
    options.markers = 12;  // 36 coordinates for 6 shapes: without the correction 8 % too small
    options.frames = 1500;
    options.noise_mm = 0.2;
    for (const bool stabilised : {false, true}) {
        const test::FitScene scene = test::fit_scene(options);
        TrainOptions training;
        training.noise_mm = 0.2;
        training.temporal.mode = TemporalPull::Mode::kOff;
        const auto pack = train(scene.tiny.rig, scene.tiny.layout, training);
        ASSERT_TRUE(pack);
        const SolvedTake solved = solve_take(pack->view(), scene.take, stabilised);
        const auto noise = noise_of_residual(pack->view(), scene.take, solved);
        ASSERT_TRUE(noise);
        EXPECT_NEAR(*noise, 0.2, 0.012) << stabilised;
    }
}

TEST(NoiseOfResidual, GrowsWithAMisplacedLayout) {
    test::FitSceneOptions options;
    options.noise_mm = 0.05;
    options.misplaced_mm = 1.0;
    const test::FitScene scene = test::fit_scene(options);
    const auto pack = train(scene.tiny.rig, scene.rough, {});
    const auto noise =
        noise_of_residual(pack->view(), scene.take, solve_take(pack->view(), scene.take, false));
    ASSERT_TRUE(noise);
    EXPECT_GT(*noise, 0.3);
    EXPECT_NEAR(noise_of_differences(scene.take).pooled_mm, 0.05, 0.01);
}

TEST(NoiseOfResidual, IsNothingWithoutFreedom) {
    const test::FitScene scene = test::fit_scene({});
    const auto pack = train(scene.tiny.rig, scene.rough, {});
    SolvedTake solved = solve_take(pack->view(), scene.take, false);
    solved.solved.assign(solved.solved.size(), false);
    EXPECT_FALSE(noise_of_residual(pack->view(), scene.take, solved));
}

}  // namespace
}  // namespace rig::host
