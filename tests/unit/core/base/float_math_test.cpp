#include "core/base/float_math.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "core/base/float_kernels.hpp"
#include "tests/support/digest.hpp"
#include "tests/support/random.hpp"

// The reference is double libm, whose errors are a hundred-millionth of the bounds.
namespace rig {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

using Lanes = std::array<float, kLaneFloats>;

struct Worst {
    double relative = 0.0;
    double ulp = 0.0;
    double absolute_when_small = 0.0;  // of results under 0.5
};

// Sixteen neighbouring floats, then a leap, from `first` to `last` in the order of their bits.
template <class Function, class Reference>
Worst worst_between(float first, float last, Function function, Reference reference) {
    Worst worst;
    constexpr std::uint32_t kLeap = 16 * 1021;
    const auto end = std::bit_cast<std::uint32_t>(last);
    for (std::uint32_t bits = std::bit_cast<std::uint32_t>(first); bits + kLaneFloats < end; bits += kLeap) {
        Lanes x;
        Lanes y;
        for (std::uint32_t i = 0; i < kLaneFloats; ++i) x[i] = std::bit_cast<float>(bits + i);
        function(x.data(), kLaneFloats, y.data());
        for (std::size_t i = 0; i < kLaneFloats; ++i) {
            const double truth = reference(static_cast<double>(x[i]));
            const double error = std::abs(static_cast<double>(y[i]) - truth);
            const auto magnitude = static_cast<float>(std::abs(truth));
            const double ulp = static_cast<double>(std::nextafter(magnitude, kInfinity) - magnitude);
            if (magnitude < 0.5F) worst.absolute_when_small = std::max(worst.absolute_when_small, error);
            worst.relative = std::max(worst.relative, error / static_cast<double>(magnitude));
            worst.ulp = std::max(worst.ulp, error / ulp);
        }
    }
    return worst;
}

TEST(ExpEach, IsWithinTheStatedError) {
    const auto reference = [](double x) { return std::exp(x); };
    for (const auto& [from, to] : {std::pair{-1e-9F, -87.0F}, std::pair{1e-9F, 88.0F}}) {
        const Worst worst = worst_between(from, to, exp_each, reference);
        EXPECT_LE(worst.relative, 8e-8);
        EXPECT_LE(worst.ulp, 1.0);
        EXPECT_GT(worst.relative, 5e-8) << "a float cannot be better: nothing was measured";
    }
}

TEST(LogEach, IsWithinTheStatedError) {
    const auto reference = [](double x) { return std::log(x); };
    for (const auto& [from, to] : {std::pair{1.1755e-38F, 0.6F}, std::pair{1.7F, 3.4e38F}}) {
        const Worst worst = worst_between(from, to, log_each, reference);
        EXPECT_LE(worst.relative, 8e-8);
        EXPECT_GT(worst.relative, 5e-8);
    }
    EXPECT_LE(worst_between(0.5F, 1.7F, log_each, reference).absolute_when_small, 3e-8);
}

TEST(ExpEach, HasExactAndExtremeValues) {
    const Lanes x{0.0F, -0.0F, kInfinity, -kInfinity, kNan, 88.1F, 3e38F, -87.1F, -3e38F, 1e-40F};
    Lanes y;
    exp_each(x.data(), kLaneFloats, y.data());
    EXPECT_EQ(y[0], 1.0F);
    EXPECT_EQ(y[1], 1.0F);
    EXPECT_EQ(y[2], kInfinity);
    EXPECT_EQ(y[3], 0.0F);
    EXPECT_TRUE(std::isnan(y[4]));
    EXPECT_EQ(y[5], kInfinity);
    EXPECT_EQ(y[6], kInfinity);
    EXPECT_EQ(y[7], 0.0F);
    EXPECT_EQ(y[8], 0.0F);
    EXPECT_EQ(y[9], 1.0F);
}

TEST(LogEach, HasExactAndExtremeValues) {
    const Lanes x{1.0F, 0.0F, -1.0F, 1e-45F, kNan, -kInfinity, 3.4e38F};
    Lanes y;
    log_each(x.data(), kLaneFloats, y.data());
    const auto floor = static_cast<float>(std::log(1.17549435e-38));
    EXPECT_EQ(y[0], 0.0F);
    EXPECT_FLOAT_EQ(y[1], floor);
    EXPECT_FLOAT_EQ(y[2], floor);
    EXPECT_FLOAT_EQ(y[3], floor);
    EXPECT_TRUE(std::isnan(y[4]));
    EXPECT_FLOAT_EQ(y[5], floor);
    EXPECT_FLOAT_EQ(y[6], static_cast<float>(std::log(3.4e38)));
}

TEST(ExpEach, WorksInPlaceAndUndoesTheLogarithm) {
    test::SeededRandom random(31);
    for (int i = 0; i < 1000; ++i) {
        Lanes x;
        for (float& value : x) value = static_cast<float>(std::exp(random.uniform(-20.0, 20.0)));
        Lanes y = x;
        log_each(y.data(), kLaneFloats, y.data());
        exp_each(y.data(), kLaneFloats, y.data());
        for (std::size_t k = 0; k < kLaneFloats; ++k) ASSERT_NEAR(y[k] / x[k], 1.0F, 3e-6F);
    }
}

// Part of the contract, as in math_test.cpp: a change of these functions changes what recorded takes re-solve
// to.
TEST(FloatMath, HasTheSameBitsEverywhere) {
    test::Digest digest;
    test::SeededRandom random(37);
    for (int i = 0; i < 2000; ++i) {
        Lanes x;
        for (float& value : x) value = static_cast<float>(random.uniform(-90.0, 90.0));
        Lanes y;
        exp_each(x.data(), kLaneFloats, y.data());
        digest.add(std::span<const float>(y));
        log_each(y.data(), kLaneFloats, y.data());
        digest.add(std::span<const float>(y));
    }
    EXPECT_EQ(digest.value(), 15081686168831106051ULL);
}

}  // namespace
}  // namespace rig
