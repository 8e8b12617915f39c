#include "firmware_host/companion/capture/board_watch.hpp"

#include <gtest/gtest.h>

#include "tests/support/random.hpp"

namespace rig::host {
namespace {

constexpr std::int64_t kStep_us = 50'000;

// Twelve points of a grid, shifted.
BoardSighting grid(double x_px, double y_px, std::size_t first = 0) {
    BoardSighting sighting;
    for (std::size_t i = first; i < first + 12; ++i) {
        sighting.points.push_back(i);
        sighting.x_px.push_back(20.0 * static_cast<double>(i % 4) + x_px);
        sighting.y_px.push_back(20.0 * static_cast<double>(i / 4) + y_px);
    }
    return sighting;
}

TEST(BoardWatch, IsStillAfterTheHoldAndNotBefore) {
    BoardWatch watch({});
    test::SeededRandom random(1);
    for (std::int64_t i = 0; i < 20; ++i) {
        BoardSighting seen = grid(100.0, 100.0);
        for (double& x : seen.x_px) x += random.normal(0.0, 0.1);  // detection is never twice the same
        const BoardMotion expected = i * kStep_us >= 300'000 ? BoardMotion::kStill : BoardMotion::kMoving;
        EXPECT_EQ(watch.push(i * kStep_us, seen), expected) << i;
    }
}

TEST(BoardWatch, AnyMotionBeginsTheHoldAnew) {
    BoardWatch watch({});
    for (std::int64_t i = 0; i < 10; ++i) (void)watch.push(i * kStep_us, grid(100.0, 100.0));
    EXPECT_EQ(watch.push(10 * kStep_us, grid(104.0, 100.0)), BoardMotion::kMoving);
    for (std::int64_t i = 11; i < 16; ++i)
        EXPECT_EQ(watch.push(i * kStep_us, grid(104.0, 100.0)), BoardMotion::kMoving) << i;
    EXPECT_EQ(watch.push(16 * kStep_us, grid(104.0, 100.0)), BoardMotion::kStill);
}

// 6 px/s: 0.3 px a picture, under the bound from one picture to the next, over it in the hold.
TEST(BoardWatch, ASlowDriftIsNoRest) {
    BoardWatch watch({});
    for (std::int64_t i = 0; i < 100; ++i) {
        const double drift_px = 0.3 * static_cast<double>(i);
        EXPECT_EQ(watch.push(i * kStep_us, grid(100.0 + drift_px, 100.0)), BoardMotion::kMoving) << i;
    }
}

TEST(BoardWatch, UnseenForgetsTheRestAndSoDoesALongGap) {
    BoardWatch watch({});
    for (std::int64_t i = 0; i < 10; ++i) (void)watch.push(i * kStep_us, grid(0.0, 0.0));
    EXPECT_EQ(watch.push(10 * kStep_us, BoardSighting{}), BoardMotion::kUnseen);
    EXPECT_EQ(watch.push(11 * kStep_us, grid(0.0, 0.0)), BoardMotion::kMoving);
    for (std::int64_t i = 12; i < 20; ++i) (void)watch.push(i * kStep_us, grid(0.0, 0.0));
    EXPECT_EQ(watch.push(20 * kStep_us, grid(0.0, 0.0)), BoardMotion::kStill);
    EXPECT_EQ(watch.push(20 * kStep_us + 2'000'000, grid(0.0, 0.0)), BoardMotion::kMoving);
}

TEST(BoardWatch, OtherPointsOfTheBoardTellNothing) {
    BoardWatch watch({});
    for (std::int64_t i = 0; i < 10; ++i) (void)watch.push(i * kStep_us, grid(0.0, 0.0));
    EXPECT_EQ(watch.push(10 * kStep_us, grid(0.0, 0.0, 8)), BoardMotion::kMoving);  // shares four
}

TEST(BoardWatch, DistanceIsOfThePointsThatBothHave) {
    const auto far = sighting_distance_px(grid(0.0, 0.0), grid(3.0, 4.0, 4), 6);
    ASSERT_TRUE(far.has_value());
    EXPECT_NEAR(*far, 5.0, 1e-12);
    EXPECT_FALSE(sighting_distance_px(grid(0.0, 0.0), grid(0.0, 0.0, 8), 6).has_value());
    EXPECT_FALSE(sighting_distance_px({}, {}, 0).has_value());
}

}  // namespace
}  // namespace rig::host
