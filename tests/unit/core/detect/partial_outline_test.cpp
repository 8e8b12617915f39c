#include "core/detect/partial_outline.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "tests/support/dot_scene/tilted_ellipse.hpp"

namespace {

using namespace rig;
using test::TiltedEllipse;

constexpr int kHalf = 128;
constexpr int kSide = 48;

constexpr TiltedEllipse kMarker{24.3, 22.8, 6.0, 4.0, 0.5};

class PartialOutline : public testing::Test {
  protected:
    // Cover by 8 x 8 samples a pixel of what `inside` holds; the blob is what is at least half covered.
    template <class Inside>
    void draw(Inside inside) {
        w->width = w->height = kSide;
        w->blob.fill(0);
        for (std::size_t y = 0; y < kSide; ++y) {
            for (std::size_t x = 0; x < kSide; ++x) {
                int count = 0;
                for (int k = 0; k < 64; ++k) {
                    const double sx = static_cast<double>(x) + (k % 8 + 0.5) / 8 - 0.5;
                    const double sy = static_cast<double>(y) + (k / 8 + 0.5) / 8 - 0.5;
                    count += inside(sx, sy) ? 4 : 0;
                }
                w->cover[y][x] = static_cast<std::int16_t>(count);
                if (count >= kHalf) w->blob[y] |= std::uint64_t{1} << x;
            }
        }
    }
    void expect_marker(double centre_px, double axes_px) const {
        EXPECT_NEAR(ellipse.x, kMarker.x, centre_px);
        EXPECT_NEAR(ellipse.y, kMarker.y, centre_px);
        const double mean = 0.5 * (ellipse.xx + ellipse.yy);
        const double half = std::hypot(0.5 * (ellipse.xx - ellipse.yy), ellipse.xy);
        EXPECT_NEAR(2.0 * std::sqrt(mean + half), kMarker.a, axes_px);
        EXPECT_NEAR(2.0 * std::sqrt(mean - half), kMarker.b, axes_px);
    }
    std::unique_ptr<BlobWorkspace> w = std::make_unique<BlobWorkspace>();
    Ellipse ellipse;
};

TEST_F(PartialOutline, AWholeOutlineIsFollowedAllAround) {
    draw([](double x, double y) { return kMarker.holds(x, y); });
    ASSERT_TRUE(follow_ellipse(*w, kHalf, {}, ellipse));
    expect_marker(0.05, 0.15);
    EXPECT_EQ(ellipse.followed, 1.0);
    const BitRows before = w->blob;
    ASSERT_TRUE(keep_ellipse(ellipse, *w));
    EXPECT_EQ(w->blob, before);
    EXPECT_EQ(count_bits(w->hidden, 0, kSide), 0);
}

TEST_F(PartialOutline, BitesCutsAndBumpsAreSeenPast) {
    constexpr TiltedEllipse kBite{27.5, 25.5, 2.5, 2.0, 0.0};
    constexpr TiltedEllipse kCut{24.3, 22.8, 9.0, 0.9, 1.9};  // across, through the middle
    constexpr TiltedEllipse kBump{18.6, 26.0, 2.6, 2.6, 0.0};
    const auto check = [&](auto inside, double centre_px) {
        w->hidden.fill(0);
        draw(inside);
        ASSERT_TRUE(follow_ellipse(*w, kHalf, {}, ellipse));
        expect_marker(centre_px, 0.6);
        ASSERT_TRUE(keep_ellipse(ellipse, *w));
        EXPECT_GT(count_bits(w->hidden, 0, kSide), 8);
    };
    check([&](double x, double y) { return kMarker.holds(x, y) && !kBite.holds(x, y); }, 0.2);
    check([&](double x, double y) { return kMarker.holds(x, y) && !kCut.holds(x, y); }, 0.2);
    check([&](double x, double y) { return kMarker.holds(x, y) || kBump.holds(x, y); }, 0.3);
    EXPECT_FALSE(follow_ellipse(*w, kHalf, {.longest_px = 10.0}, ellipse));
}

TEST_F(PartialOutline, NothingAndLinesAreNoEllipse) {
    draw([](double, double) { return false; });
    EXPECT_FALSE(follow_ellipse(*w, kHalf, {}, ellipse));
    draw([](double x, double y) { return std::abs(y - 20.0 - 0.002 * (x - 24.0) * (x - 24.0)) < 1.5; });
    EXPECT_FALSE(follow_ellipse(*w, kHalf, {}, ellipse) && ellipse.xx < 100.0);
}

TEST_F(PartialOutline, AnEmptyRingIsNotKept) {
    draw([](double x, double y) {
        const double radius = std::hypot(x - 24.0, y - 24.0);
        return radius < 8.0 && radius > 6.5;
    });
    ASSERT_TRUE(follow_ellipse(*w, kHalf, {}, ellipse));
    EXPECT_FALSE(keep_ellipse(ellipse, *w));
}

}  // namespace
