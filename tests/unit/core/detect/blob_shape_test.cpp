// Axes from moments, and each reason to refuse a shape.
#include "core/detect/blob_shape.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace {

using namespace rig;

// A filled ellipse has second moments of a quarter of its squared half axes.
SoftMoments ellipse(double half_long, double half_short, double angle_rad) {
    const double c = std::cos(angle_rad), s = std::sin(angle_rad);
    const double a = half_long * half_long / 4.0, b = half_short * half_short / 4.0;
    return {.weight = std::numbers::pi * half_long * half_short,
            .x = 10.25,
            .y = 7.5,
            .xx = a * c * c + b * s * s,
            .xy = (a - b) * s * c,
            .yy = a * s * s + b * c * c};
}

Blob disc() {
    Blob blob;
    set_axes(ellipse(5.0, 5.0, 0.0), 100, 200, blob);
    blob.contrast = 80.0;
    blob.deviation = 0.05;
    return blob;
}

TEST(BlobShape, AxesOfAnEllipseAtAnyAngle) {
    for (const double angle : {0.0, 0.4, 1.2, 2.5}) {
        Blob blob;
        set_axes(ellipse(8.0, 3.0, angle), 100, 200, blob);
        EXPECT_NEAR(blob.long_axis_px, 16.0, 1e-9);
        EXPECT_NEAR(blob.short_axis_px, 6.0, 1e-9);
        EXPECT_NEAR(blob.diameter_px, 2.0 * std::sqrt(24.0), 1e-9);
        EXPECT_DOUBLE_EQ(blob.x_px, 110.25);
        EXPECT_DOUBLE_EQ(blob.y_px, 207.5);
        EXPECT_NEAR(mean_radius_px(blob), std::sqrt(24.0), 1e-9);
    }
}

// Weights of an ellipse behind a symmetric blur: the same sum, the variance of the blur in both directions.
TEST(BlobShape, BlurIsTakenOffTheAxesAndNothingElse) {
    for (const double angle : {0.0, 0.7}) {
        const SoftMoments sharp = ellipse(8.0, 3.0, angle);
        SoftMoments blurred = sharp;
        blurred.xx += 0.4;
        blurred.yy += 0.4;
        const SoftMoments m = without_blur(blurred);
        EXPECT_NEAR(m.xx, sharp.xx, 1e-9);
        EXPECT_NEAR(m.xy, sharp.xy, 1e-9);
        EXPECT_NEAR(m.yy, sharp.yy, 1e-9);
        EXPECT_EQ(m.x, blurred.x);
        EXPECT_EQ(m.weight, blurred.weight);
    }
    const SoftMoments clean = ellipse(8.0, 3.0, 0.3);
    EXPECT_NEAR(without_blur(clean).xx, clean.xx, 1e-9);
    SoftMoments ring = clean;  // more than any blur: a shape that is no ellipse keeps its size
    ring.xx += 5.0;
    ring.yy += 5.0;
    EXPECT_NEAR(without_blur(ring).xx, ring.xx - 0.5, 1e-9);
}

TEST(BlobShape, RowsOfAnEllipseHoldThePixelsInsideIt) {
    constexpr double kX = 30.3, kY = 28.7, kXx = 20.0, kXy = 6.0, kYy = 9.0;
    const EllipseRows rows(kX, kY, kXx, kXy, kYy, 2.0);
    for (int y = 0; y < 64; ++y) {
        std::uint64_t expected = 0;
        for (int x = 0; x < 64; ++x) {
            const double dx = x - kX;
            const double dy = y - kY;
            const double square =
                (kYy * dx * dx - 2.0 * kXy * dx * dy + kXx * dy * dy) / (kXx * kYy - kXy * kXy);
            if (square <= 4.0) expected |= std::uint64_t{1} << x;
        }
        EXPECT_EQ(rows.at(y), expected) << y;
    }
}

TEST(BlobShape, ACleanDiscIsAMarker) {
    Blob blob = disc();
    judge_shape(1.5, {}, blob);
    EXPECT_EQ(blob.rejection, Rejection::kNone);
    EXPECT_LT(blob.badness, 0.4);
}

TEST(BlobShape, EveryReasonIsNamed) {
    const auto judged = [](auto change, double noise = 1.5) {
        Blob blob = disc();
        change(blob);
        judge_shape(noise, {}, blob);
        return blob.rejection;
    };
    EXPECT_EQ(judged([](Blob& b) { b.diameter_px = 2.0; }), Rejection::kSmall);
    EXPECT_EQ(judged([](Blob& b) { b.long_axis_px = 30.0; }), Rejection::kLarge);
    EXPECT_EQ(judged([](Blob&) {}, 40.0), Rejection::kFaint);
    EXPECT_EQ(judged([](Blob& b) { b.short_axis_px = 1.5; }), Rejection::kElongated);
    EXPECT_EQ(judged([](Blob& b) { b.open = 0.5; }), Rejection::kOpen);
    EXPECT_EQ(judged([](Blob& b) { b.deviation = 2.0; }), Rejection::kIrregular);
}

TEST(BlobShape, NoiseExcusesARoughOutlineAndCostsScore) {
    Blob quiet = disc(), noisy = disc();
    quiet.deviation = noisy.deviation = 0.4;
    judge_shape(1.0, {}, quiet);
    judge_shape(15.0, {}, noisy);
    EXPECT_EQ(quiet.rejection, Rejection::kIrregular);
    EXPECT_EQ(noisy.rejection, Rejection::kNone);
    Blob clean = disc();
    judge_shape(1.0, {}, clean);
    EXPECT_GT(noisy.badness, clean.badness);
}

TEST(BlobShape, TheMoreWasFilledInTheLessSureIsTheCentre) {
    Blob blob;
    EXPECT_EQ(completed_sigma_px(blob), 0.0);
    blob.hidden = true;
    blob.filled_in = 0.1;
    const double little = completed_sigma_px(blob);
    EXPECT_GT(little, 0.15);
    blob.filled_in = 0.3;
    const double much = completed_sigma_px(blob);
    EXPECT_GT(much, little);
    blob.filled_in = 0.0;  // too much was hidden to fill anything in
    EXPECT_GT(completed_sigma_px(blob), much);
    blob.filled_in = 0.3;
    blob.completed = true;
    EXPECT_GT(completed_sigma_px(blob), much);
    blob.badness = 1.0;
    EXPECT_GT(completed_sigma_px(blob), much + 0.3);
}

}  // namespace
