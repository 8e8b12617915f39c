#include "core/detect/population.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace {

using namespace rig;

// An ellipse seen through a lens whose edges are `edge_px2` wide.
Blob marker(double long_px, double short_px, double depth, double edge_px2 = 1.6) {
    Blob blob;
    blob.long_axis_px = long_px;
    blob.short_axis_px = short_px;
    blob.diameter_px = std::sqrt(long_px * short_px - edge_px2);
    blob.depth = depth;
    blob.badness = 0.1;
    blob.rejection = Rejection::kNone;
    return blob;
}

std::vector<Blob> ink_markers() {
    std::vector<Blob> blobs;
    for (int i = 0; i < 21; ++i) blobs.push_back(marker(9.0 + 0.1 * i, 8.0 + 0.05 * i, 0.79 + 0.001 * i));
    return blobs;
}

double oddness_of(const Blob& blob, Side side = Side::kBelow) {
    return oddness(population_of(ink_markers(), 8), {}, side, blob);
}

TEST(Population, MediansAndSpreadsOfTheSureMarkers) {
    std::vector<Blob> blobs = ink_markers();
    blobs.push_back(marker(30.0, 30.0, 0.1));
    blobs.back().badness = 0.9;  // not sure
    const Population population = population_of(blobs, 8);
    EXPECT_NEAR(population.size_px, 10.0, 1e-5);
    EXPECT_NEAR(population.size_spread, 1.5 * 0.05, 1e-5);  // half of them are within 0.5 px
    EXPECT_NEAR(population.depth, 0.8, 1e-5);
    EXPECT_NEAR(population.depth_spread, 1.5 * 0.005 / 0.8, 1e-5);
    EXPECT_NEAR(population.edge_px2, 1.6, 1e-5);
}

TEST(Population, TooFewMarkersSayNothing) {
    const std::vector<Blob> blobs = ink_markers();
    const Population population = population_of(std::span(blobs).first(7), 8);
    EXPECT_EQ(population.size_px, 0.0);
    EXPECT_EQ(oddness(population, {}, Side::kBelow, marker(30.0, 3.0, 0.1)), 0.0);
    EXPECT_EQ(population_of({}, 8).size_px, 0.0);
}

TEST(Population, HalfAsManyOddOnesDoNotMoveItMuch) {
    std::vector<Blob> blobs = ink_markers();
    for (int i = 0; i < 10; ++i) blobs.push_back(marker(4.5, 4.0, 0.4));
    const Population population = population_of(blobs, 8);
    EXPECT_GT(population.size_px, 9.0);
    EXPECT_GT(population.depth, 0.78);
}

TEST(Population, ANarrowMarkerShowsLessOfItsDepth) {
    EXPECT_GT(shown_depth(9.0, 1.7), 0.99);
    EXPECT_NEAR(shown_depth(4.25, 1.7), 0.93, 0.02);  // as measured on clean discs
    EXPECT_NEAR(shown_depth(3.25, 1.7), 0.74, 0.04);
    EXPECT_LT(shown_depth(4.25, 2.7), shown_depth(4.25, 1.7));  // the more so the wider the edges
    EXPECT_EQ(shown_depth(0.0, 1.7), 0.0);
}

TEST(Population, MarkersLikeTheOthersCostNothing) {
    EXPECT_LT(oddness_of(marker(10.0, 8.5, 0.8)), 0.01);
    EXPECT_LT(oddness_of(marker(9.0, 4.0, 0.72)), 0.1);  // tilted
}

TEST(Population, SizeAndDepthCost) {
    EXPECT_GT(oddness_of(marker(15.0, 12.0, 0.8)), 1.0);
    EXPECT_GT(oddness_of(marker(6.0, 5.0, 0.8)), 1.0);
    EXPECT_GT(oddness_of(marker(10.0, 8.5, 0.15)), 1.0);
    EXPECT_GT(oddness_of(marker(10.0, 8.5, 0.97)), 0.5);  // darker than ink: a hole
    EXPECT_LT(oddness_of(marker(10.0, 8.5, 0.97), Side::kAbove), 0.01);
    EXPECT_LT(oddness_of(marker(10.0, 8.5, 0.55), Side::kAbove),
              0.3);  // retro-reflection falls with the angle
    EXPECT_GT(oddness_of(marker(10.0, 8.5, 0.15), Side::kAbove), 1.0);  // but not to nothing
}

TEST(Population, AnEdgeThatFadesIsAHole) {
    std::vector<Blob> blobs = ink_markers();
    for (Blob& blob : blobs) blob.slope = 0.72, blob.snr = 50.0;
    const Population population = population_of(blobs, 8);
    EXPECT_NEAR(population.slope, 0.72, 1e-6);
    Blob hole = blobs[10];
    const double before = oddness(population, {}, Side::kBelow, hole);
    hole.slope = 0.55;
    EXPECT_GT(oddness(population, {}, Side::kBelow, hole), before + 1.0);
    EXPECT_EQ(oddness(population, {}, Side::kAbove, hole), oddness(population, {}, Side::kAbove, blobs[10]));
    hole.snr = 3.5;  // as far off as noise may take it
    EXPECT_LT(oddness(population, {}, Side::kBelow, hole), before + 0.1);
    hole.snr = 50.0;
    hole.hidden = true;  // what lies on it has edges of its own
    EXPECT_EQ(oddness(population, {}, Side::kBelow, hole), before);
}

}  // namespace
