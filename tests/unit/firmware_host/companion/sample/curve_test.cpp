#include "firmware_host/companion/sample/curve.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace rig::host {
namespace {

TEST(Curve, PassesThroughItsPointsAndStaysBetweenThem) {
    constexpr std::array kPoints{CurvePoint{0, 1}, CurvePoint{1, 4}, CurvePoint{3, 4.5}, CurvePoint{4, -2}};
    for (const CurvePoint& point : kPoints) EXPECT_DOUBLE_EQ(curve_value(kPoints, point.at), point.value);
    EXPECT_EQ(curve_value(kPoints, -5.0), 1.0);
    EXPECT_EQ(curve_value(kPoints, 9.0), -2.0);
    for (double at = 1.0; at <= 3.0; at += 0.05) {
        EXPECT_GE(curve_value(kPoints, at), 4.0);
        EXPECT_LE(curve_value(kPoints, at), 4.5);
    }
}

TEST(Curve, HasNoKinks) {
    constexpr std::array kPoints{CurvePoint{0, 1}, CurvePoint{1, 4}, CurvePoint{3, 4.5}, CurvePoint{4, -2}};
    constexpr double kStep = 1e-6;
    for (const double at : {1.0, 3.0}) {
        const double before = (curve_value(kPoints, at) - curve_value(kPoints, at - kStep)) / kStep;
        const double after = (curve_value(kPoints, at + kStep) - curve_value(kPoints, at)) / kStep;
        EXPECT_NEAR(before, after, 1e-4);
    }
}

TEST(SmoothStep, Ends) {
    EXPECT_EQ(smooth_step(2, 4, 1), 0.0);
    EXPECT_EQ(smooth_step(2, 4, 3), 0.5);
    EXPECT_EQ(smooth_step(2, 4, 5), 1.0);
}

TEST(Gaussian, RadiiAreWhereItFallsToOneOverE) {
    EXPECT_EQ(gaussian(0, 2, 0, 3), 1.0);
    EXPECT_NEAR(gaussian(2, 2, 0, 3), std::exp(-1.0), 1e-15);
    EXPECT_NEAR(gaussian(2, 2, 3, 3), std::exp(-2.0), 1e-15);
}

}  // namespace
}  // namespace rig::host
