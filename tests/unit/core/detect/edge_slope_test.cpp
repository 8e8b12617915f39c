#include "core/detect/edge_slope.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/dot_scene/dot_scene.hpp"

namespace {

using namespace rig;

// An ellipse of 5 by 3.5 px about the middle of a picture, whose edge is a ramp `width_px` wide.
test::Picture ramp(double width_px, double inside, double outside) {
    test::Picture picture{32, 32, std::vector<std::uint8_t>(32 * 32)};
    for (int y = 0; y < 32; ++y) {
        for (int x = 0; x < 32; ++x) {
            const double radius = std::hypot((x - 15.3) / 5.0, (y - 16.2) / 3.5);
            const double gradient =
                std::hypot((x - 15.3) / 25.0, (y - 16.2) / 12.25) / std::max(radius, 1e-6);
            const double cover =
                std::clamp(0.5 + (1.0 - radius) / std::max(gradient, 1e-6) / width_px, 0.0, 1.0);
            picture.pixels[static_cast<std::size_t>(32 * y + x)] =
                static_cast<std::uint8_t>(outside + cover * (inside - outside) + 0.5);
        }
    }
    return picture;
}

Blob blob(double background = 140.0) {
    Blob blob;
    blob.x_px = 15.3;
    blob.y_px = 16.2;
    blob.xx = 25.0 / 4.0;
    blob.yy = 12.25 / 4.0;
    blob.contrast = 100.0;
    blob.background = background;  // of bright ones, 255 less the level
    return blob;
}

TEST(EdgeSlope, FallsWithTheWidthOfTheEdge) {
    const double sharp = edge_slope(ramp(2.0, 40, 140).view(), Side::kBelow, blob());
    const double soft = edge_slope(ramp(4.0, 40, 140).view(), Side::kBelow, blob());
    EXPECT_NEAR(sharp, 0.9, 0.1);  // the ramp ends where it is looked at; between pixels its corners are cut
    EXPECT_NEAR(soft, 0.5, 0.06);
}

TEST(EdgeSlope, BrightOnesAreMeasuredAlikeAndGlintsOutvoted) {
    const double dark = edge_slope(ramp(3.0, 40, 140).view(), Side::kBelow, blob());
    EXPECT_NEAR(edge_slope(ramp(3.0, 140, 40).view(), Side::kAbove, blob(215.0)), dark, 0.02);
    test::Picture disturbed = ramp(3.0, 40, 140);
    for (int y = 15; y < 18; ++y)
        for (int x = 20; x < 23; ++x) disturbed.pixels[static_cast<std::size_t>(32 * y + x)] = 255;
    EXPECT_NEAR(edge_slope(disturbed.view(), Side::kBelow, blob()), dark, 0.06);
}

TEST(EdgeSlope, ShadeOnOneSideIsNoSoftEdge) {
    const double lit = edge_slope(ramp(2.0, 40, 140).view(), Side::kBelow, blob());
    // The plane of the surroundings is that of the lit skin; the marker lies in the shade.
    EXPECT_NEAR(edge_slope(ramp(2.0, 40, 100).view(), Side::kBelow, blob()), lit, 0.06);
}

TEST(EdgeSlope, NoShapeHasNoEdgeAndTheBorderIsNotCrossed) {
    const test::Picture picture = ramp(3.0, 40, 140);
    EXPECT_EQ(edge_slope(picture.view(), Side::kBelow, {}), 0.0);
    Blob corner = blob();
    corner.x_px = corner.y_px = 0.0;
    EXPECT_TRUE(std::isfinite(edge_slope(picture.view(), Side::kBelow, corner)));
    const ImageView row{picture.pixels.data(), 32, 1, 32};
    EXPECT_EQ(edge_slope(row, Side::kBelow, blob()), 0.0);
}

}  // namespace
