#include "core/detect/hidden_part.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "tests/support/dot_scene/tilted_ellipse.hpp"

namespace {

using namespace rig;
using test::TiltedEllipse;

constexpr TiltedEllipse kEllipse{24.3, 22.8, 8.0, 5.0, 0.5};

// Moments of the ellipse's pixels that are not hidden, by 8 x 8 samples a pixel.
SoftMoments moments_without(const TiltedEllipse& e, const BitRows& hidden) {
    double w = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0;
    for (int py = 0; py < 48; ++py) {
        for (int px = 0; px < 48; ++px) {
            if ((hidden[static_cast<std::size_t>(py)] >> px & 1U) != 0) continue;
            for (int k = 0; k < 64; ++k) {
                const double x = px + (k % 8 + 0.5) / 8 - 0.5;
                const double y = py + (k / 8 + 0.5) / 8 - 0.5;
                if (!e.holds(x, y)) continue;
                w += 1, sx += px, sy += py, sxx += px * px, sxy += px * py, syy += py * py;
            }
        }
    }
    const double x = sx / w;
    const double y = sy / w;
    return {w / 64, x, y, sxx / w - x * x, sxy / w - x * y, syy / w - y * y};
}

BitRows box(int left, int top, int right, int bottom) {
    BitRows rows{};
    for (int y = top; y < bottom; ++y) rows[static_cast<std::size_t>(y)] = bit_span(left, right);
    return rows;
}

TEST(HiddenPart, AHiddenCornerIsCompletedToTheWholeEllipse) {
    const TiltedEllipse e = kEllipse;
    const SoftMoments whole = moments_without(e, {});
    for (const BitRows& hidden : {box(22, 18, 26, 22), box(28, 24, 34, 32), box(14, 14, 21, 21)}) {
        const SoftMoments seen = moments_without(e, hidden);
        const SoftMoments done = complete_moments(seen, hidden, 48);
        const double before = std::hypot(seen.x - whole.x, seen.y - whole.y);
        const double after = std::hypot(done.x - whole.x, done.y - whole.y);
        EXPECT_GT(before, 0.15);
        EXPECT_LT(after, 0.3 * before) << before;
        EXPECT_NEAR(done.weight, whole.weight, 0.06 * whole.weight);
    }
}

TEST(HiddenPart, AKnownEllipseFillsWhatIsHidden) {
    const TiltedEllipse e = kEllipse;
    const SoftMoments whole = moments_without(e, {});
    const BitRows hidden = box(16, 20, 26, 26);
    const SoftMoments filled = fill_moments(moments_without(e, hidden), whole, hidden, 48);
    EXPECT_NEAR(filled.x, whole.x, 0.05);
    EXPECT_NEAR(filled.y, whole.y, 0.05);
    EXPECT_NEAR(filled.weight, whole.weight, 0.03 * whole.weight);
    EXPECT_EQ(fill_moments({}, whole, hidden, 48).weight, 0.0);
}

TEST(HiddenPart, NothingHiddenChangesNothing) {
    const SoftMoments whole = moments_without({}, {});
    const SoftMoments done = complete_moments(whole, {}, 48);
    EXPECT_NEAR(done.x, whole.x, 1e-12);
    EXPECT_NEAR(done.xx, whole.xx, 1e-9);
}

TEST(HiddenPart, MoreThanTwoFifthsAreLeftAsTheyAre) {
    const BitRows hidden = box(19, 19, 30, 27);
    const SoftMoments seen = moments_without({}, hidden);
    const SoftMoments done = complete_moments(seen, hidden, 48);
    EXPECT_EQ(done.x, seen.x);
    EXPECT_EQ(done.weight, seen.weight);
}

TEST(HiddenPart, EmptyAndFlatMomentsDoNoHarm) {
    const BitRows hidden = box(10, 10, 20, 20);
    for (const SoftMoments& seen :
         {SoftMoments{}, SoftMoments{.weight = 4.0, .x = 12.0, .y = 12.0},
          SoftMoments{.weight = 4.0, .x = 12.0, .y = 12.0, .xx = 1e-9, .yy = 4.0}}) {
        const SoftMoments done = complete_moments(seen, hidden, 48);
        EXPECT_TRUE(std::isfinite(done.x) && std::isfinite(done.y) && std::isfinite(done.weight));
    }
}

TEST(HiddenPart, MarksWhatIsBeyondTheSkinAndOneStepAround) {
    const auto w = std::make_unique<BlobWorkspace>();
    w->width = 32;
    w->height = 32;
    w->blob = box(10, 10, 20, 20);
    w->box = {10, 10, 20, 20};
    for (std::size_t y = 0; y < 32; ++y)
        for (std::size_t x = 0; x < 32; ++x)
            w->cover[y][x] = y >= 10 && y < 20 && x >= 10 && x < 20 ? 256 : 0;
    BitRows hidden{};
    EXPECT_FALSE(mark_hidden(*w, 0.02, hidden));
    w->cover[12][19] = -200;
    w->cover[28][28] = -200;  // far from the blob
    ASSERT_TRUE(mark_hidden(*w, 0.02, hidden));
    EXPECT_EQ(count_bits(hidden, 0, 32), 9);
    EXPECT_EQ(hidden[12], bit_span(18, 21));
    EXPECT_FALSE(mark_hidden(*w, 0.3, hidden));  // noise reaches as far
}

}  // namespace
