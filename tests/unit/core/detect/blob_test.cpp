// One drawn shape at a time: what is measured, and why it is refused.
#include "core/detect/blob.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "tests/support/dot_scene/dot_scene.hpp"

namespace {

using namespace rig;

constexpr int kSide = 80;

// Thresholds the picture at `level` and measures everything below (above) as one component.
Blob measure(const std::vector<std::uint8_t>& pixels, Side side, int level, const BlobLimits& limits = {}) {
    std::vector<Run> runs;
    Component component{.left = kSide, .top = kSide};
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
            const auto inside = [&](int column) {
                const int value = pixels[static_cast<std::size_t>(y * kSide + column)];
                return side == Side::kBelow ? value < level : value > level;
            };
            if (!inside(x)) continue;
            const int begin = x;
            while (x < kSide && inside(x)) ++x;
            runs.push_back({static_cast<std::uint16_t>(y), static_cast<std::uint16_t>(begin),
                            static_cast<std::uint16_t>(x)});
            component.left = std::min(component.left, static_cast<std::uint16_t>(begin));
            component.right = std::max(component.right, static_cast<std::uint16_t>(x - 1));
            component.top = std::min(component.top, static_cast<std::uint16_t>(y));
            component.bottom = static_cast<std::uint16_t>(y);
            component.area_px += static_cast<std::uint32_t>(x - begin);
        }
    }
    component.count = static_cast<std::uint32_t>(runs.size());
    const auto workspace = std::make_unique<BlobWorkspace>();
    return measure_blob(
        {.pixels = pixels.data(), .width_px = kSide, .height_px = kSide, .stride_bytes = kSide}, side,
        component, runs, {}, limits, *workspace);
}

test::Scene one_dot(double x, double y, double long_px, double short_px) {
    return test::single_dot_scene(
        kSide, 120.0,
        {.x_px = x, .y_px = y, .long_px = long_px, .short_px = short_px, .angle_rad = 0.6, .paint = 0.2});
}

TEST(Blob, ADiscIsMeasuredToAFewHundredthsWhateverTheThreshold) {
    for (const double diameter : {5.0, 8.0, 12.0, 20.0}) {
        const auto picture = test::render(one_dot(40.3, 39.8, diameter, diameter));
        for (const int level : {50, 72, 95}) {
            const Blob blob = measure(picture.pixels, Side::kBelow, level);
            ASSERT_EQ(blob.rejection, Rejection::kNone) << diameter << " " << level;
            EXPECT_NEAR(blob.x_px, 40.3, 0.03);  // the drawing itself has samples 0.2 px apart
            EXPECT_NEAR(blob.y_px, 39.8, 0.03);
            EXPECT_NEAR(blob.diameter_px, diameter, 0.06 * diameter);
            EXPECT_NEAR(blob.background, 120.0, 1.5);
            EXPECT_NEAR(blob.depth, 0.8, diameter < 10.0 ? 0.22 : 0.08);  // blur takes depth from small discs
        }
    }
}

TEST(Blob, AnEllipseKeepsItsAxes) {
    const Blob blob = measure(test::render(one_dot(41.25, 38.6, 16.0, 8.0)).pixels, Side::kBelow, 72);
    ASSERT_EQ(blob.rejection, Rejection::kNone);
    EXPECT_NEAR(blob.x_px, 41.25, 0.02);
    EXPECT_NEAR(blob.y_px, 38.6, 0.02);
    EXPECT_NEAR(blob.long_axis_px, 16.0, 0.5);
    EXPECT_NEAR(blob.short_axis_px, 8.0, 0.5);
}

TEST(Blob, GradientOfLightDoesNotPullTheCentre) {
    test::Scene scene = one_dot(40.0, 40.0, 12.0, 12.0);
    scene.light.gradient = 1.2;  // 15 grey levels across the disc
    const Blob blob = measure(test::render(scene).pixels, Side::kBelow, 60);
    EXPECT_NEAR(blob.x_px, 40.0, 0.05);
    EXPECT_NEAR(blob.y_px, 40.0, 0.05);
}

TEST(Blob, InvertedLightIsTheSameBlob) {
    test::Scene scene = one_dot(40.3, 39.8, 10.0, 7.0);
    scene.light.read_noise = 2.0;
    const auto picture = test::render(scene);
    const Blob dark = measure(picture.pixels, Side::kBelow, 72);
    const Blob bright = measure(test::inverted(picture).pixels, Side::kAbove, 255 - 72);
    EXPECT_EQ(dark.rejection, bright.rejection);
    EXPECT_NEAR(dark.x_px, bright.x_px, 0.001);  // the light that the slope of noise is measured by differs
    EXPECT_NEAR(dark.y_px, bright.y_px, 0.001);
    EXPECT_EQ(dark.contrast, bright.contrast);
}

TEST(Blob, RefusalsSayWhy) {
    const BlobLimits large_only{.min_diameter_px = 8.0};
    EXPECT_EQ(measure(test::render(one_dot(40, 40, 6, 6)).pixels, Side::kBelow, 72, large_only).rejection,
              Rejection::kSmall);
    EXPECT_EQ(measure(test::render(one_dot(40, 40, 40, 30)).pixels, Side::kBelow, 72).rejection,
              Rejection::kLarge);
    EXPECT_EQ(measure(test::render(one_dot(40, 40, 60, 60)).pixels, Side::kBelow, 72).rejection,
              Rejection::kLarge);
    EXPECT_EQ(measure(test::render(one_dot(40, 40, 24, 3)).pixels, Side::kBelow, 80).rejection,
              Rejection::kElongated);
    EXPECT_EQ(measure(test::render(one_dot(2, 40, 10, 10)).pixels, Side::kBelow, 72).rejection,
              Rejection::kEdge);
    EXPECT_EQ(measure(test::render(one_dot(40, 77, 10, 10)).pixels, Side::kBelow, 72).rejection,
              Rejection::kEdge);

    test::Scene faint = one_dot(40, 40, 10, 10);
    faint.dots[0].paint = 0.95;
    EXPECT_EQ(measure(test::render(faint).pixels, Side::kBelow, 118).rejection, Rejection::kFaint);

    test::Scene two = one_dot(35, 40, 10, 10);
    two.dots.push_back(two.dots[0]);
    two.dots[1].x_px = 44.8;
    const Rejection merged = measure(test::render(two).pixels, Side::kBelow, 100).rejection;
    EXPECT_TRUE(merged == Rejection::kIrregular || merged == Rejection::kSeveral) << static_cast<int>(merged);
}

TEST(Blob, AGlintInsideIsFilled) {
    test::Scene scene = one_dot(40.3, 39.8, 16.0, 16.0);
    scene.dots[0].glint = true;
    const Blob blob = measure(test::render(scene).pixels, Side::kBelow, 72);
    ASSERT_EQ(blob.rejection, Rejection::kNone);
    EXPECT_NEAR(blob.x_px, 40.3, 0.15);
    EXPECT_NEAR(blob.y_px, 39.8, 0.15);
}

}  // namespace
