#include "core/detect/lobes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "core/detect/detector.hpp"
#include "tests/support/dot_scene/dot_scene.hpp"
#include "tests/support/dot_scene/match.hpp"

namespace {

using namespace rig;

constexpr double kSize = 9.0;

template <class Inside>
BitRows draw(Inside inside) {
    BitRows rows{};
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
            if (inside(x, y)) rows[static_cast<std::size_t>(y)] |= std::uint64_t{1} << x;
        }
    }
    return rows;
}

const BitRows everywhere = draw([](int, int) { return true; });

bool in_disc(double x, double y, double centre_x, double centre_y, double radius) {
    return std::hypot(x - centre_x, y - centre_y) <= radius;
}

TEST(Lobes, ADiscAtAWideAreaOrAtALineIsOne) {
    Lobes lobes;
    const auto wide = [](int x, int y) { return y < 24 || in_disc(x, y, 30.0, 26.0, 4.5); };
    find_lobes(draw(wide), everywhere, 64, 64, kSize, lobes);
    ASSERT_EQ(lobes.size(), 1U);
    EXPECT_NE(lobes[0][28] >> 30 & 1U, 0U);
    EXPECT_EQ(lobes[0][20], 0U);
    const auto line = [](int x, int y) { return (y > 33 && y < 37) || in_disc(x, y, 30.0, 31.0, 4.5); };
    find_lobes(draw(line), everywhere, 64, 64, kSize, lobes);
    ASSERT_EQ(lobes.size(), 1U);
    EXPECT_NE(lobes[0][30] >> 30 & 1U, 0U);
    EXPECT_EQ(lobes[0][35] >> 8 & 1U, 0U);
}

TEST(Lobes, OneWithoutAMarkIsNone) {
    Lobes lobes;
    const BitRows area = draw([](int x, int y) {
        return y < 24 || in_disc(x, y, 18.0, 26.0, 4.5) || in_disc(x, y, 44.0, 26.0, 4.5);
    });
    find_lobes(area, everywhere, 64, 64, kSize, lobes);
    EXPECT_EQ(lobes.size(), 2U);
    find_lobes(area, draw([](int x, int y) { return x == 44 && y == 29; }), 64, 64, kSize, lobes);
    ASSERT_EQ(lobes.size(), 1U);
    EXPECT_NE(lobes[0][28] >> 44 & 1U, 0U);
}

TEST(Lobes, AreasLinesAndWhatTheWindowCutsAreNone) {
    Lobes lobes;
    find_lobes(draw([](int, int y) { return y < 24; }), everywhere, 64, 64, kSize, lobes);
    EXPECT_TRUE(lobes.empty());
    find_lobes(draw([](int, int y) { return y > 33 && y < 37; }), everywhere, 64, 64, kSize, lobes);
    EXPECT_TRUE(lobes.empty());
    find_lobes(draw([](int x, int y) { return y < 24 || in_disc(x, y, 62.0, 26.0, 4.5); }), everywhere, 64,
               64, kSize, lobes);
    EXPECT_TRUE(lobes.empty());
    find_lobes({}, everywhere, 64, 64, kSize, lobes);
    EXPECT_TRUE(lobes.empty());
}

// Markers all over the image, one of them at the border of a highlight as bright as they are.
TEST(Lobes, AMarkerAtTheBorderOfAHighlightIsFound) {
    test::Scene scene;
    for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 6; ++column) {
            scene.dots.push_back({60.0 + 70.0 * column + 3.0 * row, 50.0 + 80.0 * row, 10.0, 9.0, 0.3, 3.0});
        }
    }
    scene.light.skin = 50.0;
    scene.light.texture = 0.0;
    const test::SceneDot marker = scene.dots[9];
    scene.dots.push_back({marker.x_px, marker.y_px + 18.0, 40.0, 28.0, 0.0, 3.0});
    test::Picture picture = test::render(scene);
    const auto detector = std::make_unique<Detector>();
    Observations observations;
    DetectorReport report;
    detector->detect(picture.view(), observations, report);
    ASSERT_EQ(report.polarity, MarkerPolarity::kBright);
    EXPECT_EQ(observations.size(), 24U);
    double nearest = 1e9;
    for (const test::SeenDot& seen : test::seen_dots(observations))
        nearest = std::min(nearest, std::hypot(seen.x_px - marker.x_px, seen.y_px - marker.y_px));
    EXPECT_LT(nearest, 0.5);
}

}  // namespace
