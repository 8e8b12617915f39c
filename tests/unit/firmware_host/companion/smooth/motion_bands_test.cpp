#include "firmware_host/companion/smooth/motion_bands.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tests/support/random.hpp"

namespace rig::host {
namespace {

using test::SeededRandom;

constexpr double kFar = 1e9;

std::vector<double> random_curve(std::size_t frames, SeededRandom& random) {
    std::vector<double> x(frames);
    for (double& value : x) value = random.uniform(0.0, 1.0);
    return x;
}

std::vector<double> sine(std::size_t frames, double period_frames) {
    std::vector<double> x(frames);
    for (std::size_t n = 0; n < frames; ++n)
        x[n] = 0.5 + 0.3 * std::sin(2.0 * std::numbers::pi * static_cast<double>(n) / period_frames);
    return x;
}

// Of the middle half, where the ends do not reach.
double swing(const std::vector<double>& x) {
    const auto begin = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 4);
    const auto [low, high] = std::minmax_element(begin, begin + static_cast<std::ptrdiff_t>(x.size() / 2));
    return 0.5 * (*high - *low);
}

TEST(MotionBands, CountsPowersOfTwo) {
    for (const auto& [frames, bands] :
         {std::pair{0U, 0U}, {1U, 0U}, {2U, 1U}, {3U, 1U}, {4U, 2U}, {1023U, 9U}, {1024U, 10U}})
        EXPECT_EQ(band_count(frames), bands) << frames;
}

TEST(MotionBands, GainsOfOneGiveTheInputBack) {
    SeededRandom random(51);
    for (const std::size_t frames : {1U, 2U, 3U, 5U, 17U, 64U, 1000U, 4097U}) {
        const std::vector<double> x = random_curve(frames, random);
        const std::vector<double> ones(band_count(frames), 1.0);
        for (const auto& gains : {std::vector<double>{}, ones}) {
            const std::vector<double> y = shape_bands(x, gains, 0.0, 1.0);
            for (std::size_t n = 0; n < frames; ++n) ASSERT_NEAR(y[n], x[n], 4e-15) << frames << " " << n;
        }
    }
}

TEST(MotionBands, BandsAreALinearSplit) {
    SeededRandom random(52);
    const std::vector<double> x = random_curve(200, random);
    // What gain 0 takes out of one band, gain 2 puts in once more.
    for (std::size_t k = 0; k < band_count(200); ++k) {
        std::vector<double> gains(k + 1, 1.0);
        gains[k] = 0.0;
        const std::vector<double> without = shape_bands(x, gains, -kFar, kFar);
        gains[k] = 2.0;
        const std::vector<double> twice = shape_bands(x, gains, -kFar, kFar);
        for (std::size_t n = 0; n < x.size(); ++n) ASSERT_NEAR(without[n] + twice[n], 2.0 * x[n], 1e-12);
    }
}

// The response of w_0 = (1 4 6 4 1) / 16 is cos^4(pi f); band 0 lets 1 - cos^4 through.
TEST(MotionBands, TheFirstBandHasTheResponseOfTheSpline) {
    for (const double period : {2.5, 4.0, 8.0, 20.0}) {
        const std::vector<double> x = sine(800, period);
        const std::vector<double> y = shape_bands(x, std::vector<double>{0.0}, -kFar, kFar);
        const double pass = std::pow(std::cos(std::numbers::pi / period), 4);
        for (std::size_t n = 200; n < 600; ++n) ASSERT_NEAR(y[n], 0.5 + pass * (x[n] - 0.5), 1e-12) << period;
    }
}

TEST(MotionBands, ABandIsWhereItsPeriodIs) {
    for (std::size_t k = 1; k < 5; ++k) {
        const double period = band_period_frames(k);
        EXPECT_NEAR(period / band_period_frames(k + 1), 0.5, 0.03);
        std::vector<double> gains(k + 1, 1.0);
        gains[k] = 0.0;
        const auto kept = [&](double p) { return swing(shape_bands(sine(2048, p), gains, -kFar, kFar)); };
        EXPECT_LT(kept(period), kept(period / 4.0));
        EXPECT_LT(kept(period), kept(period * 4.0));
    }
}

TEST(MotionBands, RampsAndRestStayToTheEnds) {
    std::vector<double> ramp(100);
    for (std::size_t n = 0; n < ramp.size(); ++n) ramp[n] = 0.1 + 0.005 * static_cast<double>(n);
    const std::vector<double> gains(band_count(100), 0.0);
    const std::vector<double> y = shape_bands(ramp, std::span(gains).first(3), 0.0, 1.0);
    for (std::size_t n = 0; n < ramp.size(); ++n) EXPECT_NEAR(y[n], ramp[n], 1e-12) << n;
    const std::vector<double> rest(100, 0.3);
    for (const double value : shape_bands(rest, gains, 0.0, 1.0)) EXPECT_NEAR(value, 0.3, 1e-14);
    for (const double value : smooth_gaussian(rest, 7.0, 0.0, 1.0)) EXPECT_NEAR(value, 0.3, 1e-14);
}

TEST(MotionBands, NeverLeaveTheRange) {
    SeededRandom random(53);
    bool touched = false;
    for (int round = 0; round < 200; ++round) {
        const std::size_t frames = 1 + random.below(300);
        const std::vector<double> x = random_curve(frames, random);
        std::vector<double> gains(random.below(band_count(frames) + 1));
        for (double& gain : gains) gain = random.uniform(-100.0, 100.0);
        for (const auto& y :
             {shape_bands(x, gains, 0.0, 0.75), smooth_gaussian(x, random.uniform(0.0, 400.0), 0.0, 0.75)}) {
            ASSERT_EQ(y.size(), frames);
            for (const double value : y) {
                ASSERT_TRUE(value >= 0.0 && value <= 0.75);
                touched = touched || value == 0.75;
            }
        }
    }
    EXPECT_TRUE(touched);
}

TEST(MotionBands, AGaussianHasItsResponse) {
    const double sigma = 3.0;
    for (const double period : {10.0, 20.0, 60.0}) {
        const std::vector<double> x = sine(1200, period);
        const std::vector<double> y = smooth_gaussian(x, sigma, -kFar, kFar);
        const double pass = std::exp(-0.5 * std::pow(2.0 * std::numbers::pi * sigma / period, 2));
        for (std::size_t n = 300; n < 900; ++n) ASSERT_NEAR(y[n], 0.5 + pass * (x[n] - 0.5), 1e-4) << period;
    }
    SeededRandom random(54);
    const std::vector<double> x = random_curve(50, random);
    EXPECT_EQ(smooth_gaussian(x, 0.0, 0.0, 1.0), x);
}

}  // namespace
}  // namespace rig::host
