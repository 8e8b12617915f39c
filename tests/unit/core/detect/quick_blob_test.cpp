// The quick measurement on one drawn dot: right by itself, and silent where it has nothing to say.
#include "core/detect/quick_blob.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "tests/support/dot_scene/dot_scene.hpp"
#include "tests/support/random.hpp"

namespace {

using namespace rig;

constexpr int kSide = 80;

test::Scene one_dot(double x, double y, double long_px, double short_px, double paint) {
    const test::SceneDot dot{
        .x_px = x, .y_px = y, .long_px = long_px, .short_px = short_px, .angle_rad = 0.6, .paint = paint};
    return test::single_dot_scene(kSide, paint < 1.0 ? 120.0 : 45.0, dot);
}

Component box(int left, int top, int right, int bottom) {
    return {.area_px = 1,
            .left = static_cast<std::uint16_t>(left),
            .top = static_cast<std::uint16_t>(top),
            .right = static_cast<std::uint16_t>(right),
            .bottom = static_cast<std::uint16_t>(bottom)};
}

// Of the dot at (x, y), whose box is as large as its diameter and a pixel more on every side.
bool measure(const test::Picture& picture, double x, double y, double diameter, Side side, Blob& blob) {
    const int half = static_cast<int>(std::ceil(0.5 * diameter)) + 1;
    const int cx = static_cast<int>(std::lround(x)), cy = static_cast<int>(std::lround(y));
    QuickStart start;
    if (!frame_component(picture.view(), box(cx - half, cy - half, cx + half, cy + half), start))
        return false;
    const auto workspace = std::make_unique<QuickWorkspace>();
    return measure_quickly(picture.view(), side, start, {}, *workspace, blob);
}

TEST(QuickBlob, ADiscIsMeasuredToAFewHundredths) {
    for (const double paint : {0.2, 3.5}) {
        const Side side = paint < 1.0 ? Side::kBelow : Side::kAbove;
        for (const double diameter : {5.0, 8.0, 12.0, 20.0}) {
            const test::Picture picture = test::render(one_dot(40.3, 39.8, diameter, diameter, paint));
            Blob blob;
            ASSERT_TRUE(measure(picture, 40.3, 39.8, diameter, side, blob)) << paint << " " << diameter;
            ASSERT_EQ(blob.rejection, Rejection::kNone) << paint << " " << diameter;
            EXPECT_NEAR(blob.x_px, 40.3, 0.03);  // the drawing itself has samples 0.2 px apart
            EXPECT_NEAR(blob.y_px, 39.8, 0.03);
            EXPECT_NEAR(blob.diameter_px, diameter, 0.06 * diameter);
            EXPECT_NEAR(blob.background, paint < 1.0 ? 120.0 : 210.0, 1.5);
        }
    }
}

TEST(QuickBlob, LightThatFallsOffDoesNotMoveTheCentre) {
    test::Scene scene = one_dot(40.0, 40.0, 12.0, 12.0, 0.2);
    scene.light.gradient = 1.2;  // from 48 to 192 across these 80 pixels
    Blob blob;
    ASSERT_TRUE(measure(test::render(scene), 40.0, 40.0, 12.0, Side::kBelow, blob));
    EXPECT_NEAR(blob.x_px, 40.0, 0.04);
    EXPECT_NEAR(blob.y_px, 40.0, 0.04);
}

TEST(QuickBlob, AnEllipseKeepsItsAxes) {
    Blob blob;
    ASSERT_TRUE(
        measure(test::render(one_dot(41.25, 38.6, 16.0, 8.0, 0.2)), 41.25, 38.6, 16.0, Side::kBelow, blob));
    EXPECT_NEAR(blob.long_axis_px, 16.0, 1.0);
    EXPECT_NEAR(blob.short_axis_px, 8.0, 0.8);
    EXPECT_LT(blob.deviation, 0.15);
}

TEST(QuickBlob, SkinIsFaint) {
    Blob blob;
    ASSERT_TRUE(
        measure(test::render(one_dot(10.0, 10.0, 6.0, 6.0, 0.2)), 55.0, 55.0, 8.0, Side::kBelow, blob));
    EXPECT_EQ(blob.rejection, Rejection::kFaint);
}

TEST(QuickBlob, ALineIsNoMarker) {
    test::Picture picture = test::render(one_dot(10.0, 10.0, 4.0, 4.0, 0.2));
    for (int x = 30; x < 56; ++x) {
        for (int y = 49; y < 52; ++y) picture.pixels[static_cast<std::size_t>(y * kSide + x)] = 20;
    }
    QuickStart start;
    ASSERT_TRUE(frame_component(picture.view(), box(30, 49, 55, 51), start));
    const auto workspace = std::make_unique<QuickWorkspace>();
    Blob blob;
    EXPECT_TRUE(!measure_quickly(picture.view(), Side::kBelow, start, {}, *workspace, blob) ||
                blob.rejection != Rejection::kNone);
}

TEST(QuickBlob, WindowsThatDoNotFitAreLeftToOthers) {
    const test::Picture picture = test::render(one_dot(40.0, 40.0, 8.0, 8.0, 0.2));
    QuickStart start;
    EXPECT_FALSE(frame_component(picture.view(), box(0, 30, 8, 38), start));
    EXPECT_FALSE(frame_component(picture.view(), box(30, 0, 38, 8), start));
    EXPECT_FALSE(frame_component(picture.view(), box(kSide - 9, 30, kSide - 1, 38), start));
    EXPECT_FALSE(frame_component(picture.view(), box(30, kSide - 9, 38, kSide - 1), start));
    EXPECT_FALSE(frame_component(picture.view(), box(10, 10, 70, 30), start)) << "too large";
    EXPECT_FALSE(frame_component(picture.view(), box(40, 40, 40, 60), start)) << "narrower than eight pixels";
    EXPECT_TRUE(frame_component(picture.view(), box(36, 36, 44, 44), start));
}

// Of bytes that mean nothing, in memory that ends with the last pixel: no harm, and the same twice.
TEST(QuickBlob, NoBytesDoHarm) {
    test::SeededRandom random(17);
    const auto workspace = std::make_unique<QuickWorkspace>();
    for (int round = 0; round < 2000; ++round) {
        const int width = 16 + static_cast<int>(random.uniform(0.0, 48.0));
        const int height = 16 + static_cast<int>(random.uniform(0.0, 48.0));
        test::Picture picture{width, height,
                              std::vector<std::uint8_t>(static_cast<std::size_t>(width * height))};
        const double range = random.uniform(1.0, 256.0);
        for (std::uint8_t& pixel : picture.pixels)
            pixel = static_cast<std::uint8_t>(random.uniform(0.0, range));
        const int left = static_cast<int>(random.uniform(0.0, width - 1.0));
        const int top = static_cast<int>(random.uniform(0.0, height - 1.0));
        const int right = left + static_cast<int>(random.uniform(0.0, static_cast<double>(width - left)));
        const int bottom = top + static_cast<int>(random.uniform(0.0, static_cast<double>(height - top)));
        QuickStart start;
        if (!frame_component(picture.view(), box(left, top, right, bottom), start)) continue;
        const Side side = round % 2 == 0 ? Side::kBelow : Side::kAbove;
        Blob first, second;
        const bool sure = measure_quickly(picture.view(), side, start, {}, *workspace, first);
        ASSERT_EQ(sure, measure_quickly(picture.view(), side, start, {}, *workspace, second));
        if (!sure) continue;
        EXPECT_EQ(first.x_px, second.x_px);
        EXPECT_EQ(first.rejection, second.rejection);
        if (first.rejection != Rejection::kNone) continue;
        EXPECT_TRUE(first.x_px >= start.left && first.x_px < start.left + start.width);
        EXPECT_TRUE(first.y_px >= start.top && first.y_px < start.top + start.height);
    }
}

}  // namespace
