#include "core/stabilise/similarity_2d.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace rig {
namespace {

std::vector<PlanarMarker> square() {
    std::vector<PlanarMarker> markers;
    for (const Vec2& p : {Vec2{100.0, 100.0}, Vec2{300.0, 100.0}, Vec2{300.0, 300.0}, Vec2{100.0, 300.0}}) {
        markers.push_back({p, p, 1.0});
    }
    return markers;
}

TEST(Similarity2d, KnowsShiftTurnAndScale) {
    std::vector<PlanarMarker> markers = square();
    for (PlanarMarker& m : markers) m.seen = Vec2{-1.5 * m.neutral[1] + 7.0, 1.5 * m.neutral[0] - 3.0};
    Similarity2dReport report;
    const Similarity2d fit = fit_similarity_2d(markers, {}, report);
    ASSERT_TRUE(report.ok);
    EXPECT_EQ(report.used, 4);
    EXPECT_EQ(report.doubted, 0);
    EXPECT_NEAR(fit.scale(), 1.5, 1e-12);
    EXPECT_NEAR(fit.turn_rad(), 1.5707963267948966, 1e-12);
    EXPECT_LT((fit.shift - Vec2{7.0, -3.0}).norm(), 1e-9);
    for (const PlanarMarker& m : markers) {
        EXPECT_LT((fit.apply(m.neutral) - m.seen).norm(), 1e-9);
        EXPECT_LT((fit.apply_inverse(m.seen) - m.neutral).norm(), 1e-9);
    }
}

TEST(Similarity2d, WeightsDecideBetweenContradictions) {
    // Of two pairs of markers, either of which fixes the similarity, the heavy one wins.
    std::vector<PlanarMarker> markers = square();
    for (std::size_t k : {0U, 2U}) markers[k].weight = 1e8;
    for (std::size_t k : {1U, 3U}) markers[k].seen += Vec2{5.0, 2.0};
    Similarity2dReport report;
    const Similarity2d fit = fit_similarity_2d(markers, {}, report);
    ASSERT_TRUE(report.ok);
    EXPECT_LT((fit.apply(markers[0].neutral) - markers[0].seen).norm(), 1e-5);
    EXPECT_GT((fit.apply(markers[1].neutral) - markers[1].seen).norm(), 5.0);
}

TEST(Similarity2d, UnseenMarkersDoNotCount) {
    std::vector<PlanarMarker> markers = square();
    const double nan = std::numeric_limits<double>::quiet_NaN();
    markers.push_back({Vec2{200.0, 150.0}, Vec2{nan, 3.0}, 1.0});
    markers.push_back({Vec2{210.0, 150.0}, Vec2{HUGE_VAL, 3.0}, 1.0});
    markers.push_back({Vec2{220.0, 150.0}, Vec2{900.0, 3.0}, 0.0});
    markers.push_back({Vec2{220.0, 150.0}, Vec2{900.0, 3.0}, -1.0});
    markers.push_back({Vec2{230.0, 150.0}, Vec2{900.0, 3.0}, nan});
    Similarity2dReport report;
    const Similarity2d fit = fit_similarity_2d(markers, {}, report);
    ASSERT_TRUE(report.ok);
    EXPECT_EQ(report.used, 4);
    EXPECT_NEAR(fit.a, 1.0, 1e-12);
    EXPECT_NEAR(fit.b, 0.0, 1e-12);
}

TEST(Similarity2d, OnePlaceIsNotEnough) {
    Similarity2dReport report;
    const std::vector<PlanarMarker> one{{Vec2{10.0, 20.0}, Vec2{40.0, 50.0}, 1.0}};
    const std::vector<PlanarMarker> twice{one[0], one[0]};
    for (const auto& markers : {std::vector<PlanarMarker>{}, one, twice}) {
        const Similarity2d fit = fit_similarity_2d(markers, {}, report);
        EXPECT_FALSE(report.ok);
        EXPECT_EQ(fit.a, 1.0);
        EXPECT_EQ(fit.b, 0.0);
        EXPECT_EQ(fit.shift.norm(), 0.0);
    }
    const std::vector<PlanarMarker> two{one[0], {Vec2{11.0, 20.0}, Vec2{40.0, 51.0}, 1.0}};
    EXPECT_NEAR(fit_similarity_2d(two, {}, report).turn_rad(), 1.5707963267948966, 1e-12);
    EXPECT_TRUE(report.ok);
}

}  // namespace
}  // namespace rig
