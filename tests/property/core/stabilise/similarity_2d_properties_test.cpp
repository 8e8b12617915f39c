#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <vector>

#include "core/stabilise/similarity_2d.hpp"
#include "tests/support/random.hpp"

namespace rig {
namespace {

struct Draw {
    std::vector<PlanarMarker> markers;
    long double a;
    long double b;
    long double x;
    long double y;
};

// 60 markers over a face of 300 px, any turn, scale 0.5 to 2, anywhere in a picture.
Draw draw(test::SeededRandom& random, double noise_px) {
    Draw d;
    const auto scale = static_cast<long double>(random.uniform(0.5, 2.0));
    const auto turn = static_cast<long double>(random.uniform(-3.1, 3.1));
    d.a = scale * std::cos(turn);
    d.b = scale * std::sin(turn);
    d.x = static_cast<long double>(random.uniform(-300.0, 900.0));
    d.y = static_cast<long double>(random.uniform(-300.0, 900.0));
    for (int k = 0; k < 60; ++k) {
        PlanarMarker m;
        m.neutral = Vec2{random.uniform(170.0, 470.0), random.uniform(90.0, 390.0)};
        const auto px = static_cast<long double>(m.neutral[0]);
        const auto py = static_cast<long double>(m.neutral[1]);
        m.seen = Vec2{static_cast<double>(d.a * px - d.b * py + d.x),
                      static_cast<double>(d.b * px + d.a * py + d.y)};
        m.seen += Vec2{random.normal(0.0, noise_px), random.normal(0.0, noise_px)};
        m.weight = random.uniform(0.2, 3.0);
        d.markers.push_back(m);
    }
    return d;
}

TEST(Similarity2dProperties, ExactMotionIsFoundExactly) {
    test::SeededRandom random(171);
    for (int round = 0; round < 2000; ++round) {
        const Draw d = draw(random, 0.0);
        Similarity2dReport report;
        const Similarity2d fit = fit_similarity_2d(d.markers, {}, report);
        ASSERT_TRUE(report.ok);
        ASSERT_NEAR(fit.a, static_cast<double>(d.a), 1e-11);
        ASSERT_NEAR(fit.b, static_cast<double>(d.b), 1e-11);
        ASSERT_NEAR(fit.shift[0], static_cast<double>(d.x), 1e-8);
        ASSERT_NEAR(fit.shift[1], static_cast<double>(d.y), 1e-8);
    }
}

// With a reach that nothing leaves the fit is plain least squares: the normal equations hold, in long double.
TEST(Similarity2dProperties, WithoutDoubtTheNormalEquationsHold) {
    test::SeededRandom random(172);
    for (int round = 0; round < 1000; ++round) {
        const Draw d = draw(random, 3.0);
        Similarity2dReport report;
        const Similarity2d fit = fit_similarity_2d(d.markers, {1e9, 1.0}, report);
        ASSERT_TRUE(report.ok);
        long double slope[4] = {0.0L, 0.0L, 0.0L, 0.0L};
        long double size = 0.0L;
        for (const PlanarMarker& m : d.markers) {
            const auto px = static_cast<long double>(m.neutral[0]);
            const auto py = static_cast<long double>(m.neutral[1]);
            const auto w = static_cast<long double>(m.weight);
            const long double ex =
                static_cast<long double>(m.seen[0]) - (fit.a * px - fit.b * py + fit.shift[0]);
            const long double ey =
                static_cast<long double>(m.seen[1]) - (fit.b * px + fit.a * py + fit.shift[1]);
            slope[0] += w * (ex * px + ey * py);
            slope[1] += w * (ey * px - ex * py);
            slope[2] += w * ex;
            slope[3] += w * ey;
            size += w * (px * px + py * py);
        }
        for (const long double s : slope) ASSERT_LT(std::fabs(static_cast<double>(s / size)), 1e-12);
    }
}

// Up to three in ten markers anywhere in the picture: the pose stays that of the others.
TEST(Similarity2dProperties, StrayMarkersDoNotMoveTheFit) {
    test::SeededRandom random(173);
    double worst_px = 0.0;
    for (int round = 0; round < 2000; ++round) {
        Draw d = draw(random, 0.2);
        for (PlanarMarker& m : d.markers) m.weight = 1.0;
        const std::size_t strays = static_cast<std::size_t>(round) % 19;
        for (std::size_t k = 0; k < strays; ++k) {
            d.markers[k].seen += Vec2{random.uniform(-200.0, 200.0), random.uniform(-200.0, 200.0)};
        }
        Similarity2dReport report;
        const Similarity2d fit = fit_similarity_2d(d.markers, {}, report);
        ASSERT_TRUE(report.ok);
        for (std::size_t k = strays; k < 60; ++k) {
            const Vec2 p = d.markers[k].neutral;
            const Vec2 truth{
                static_cast<double>(d.a) * p[0] - static_cast<double>(d.b) * p[1] + static_cast<double>(d.x),
                static_cast<double>(d.b) * p[0] + static_cast<double>(d.a) * p[1] + static_cast<double>(d.y)};
            worst_px = std::max(worst_px, (fit.apply(p) - truth).norm());
        }
    }
    std::printf("worst place of a believed marker: %.3f px off\n", worst_px);
    EXPECT_LT(worst_px, 0.3);
}

// A face that speaks moves its jaw: a fifth of the markers shifted alike must not become head motion.
TEST(Similarity2dProperties, ExpressionDoesNotBecomeMotion) {
    test::SeededRandom random(174);
    for (int round = 0; round < 300; ++round) {
        Draw d = draw(random, 0.1);
        std::sort(d.markers.begin(), d.markers.end(),
                  [](const PlanarMarker& l, const PlanarMarker& r) { return l.neutral[1] > r.neutral[1]; });
        for (std::size_t k = 0; k < 12; ++k) d.markers[k].seen += Vec2{0.0, 15.0};
        for (PlanarMarker& m : d.markers) m.weight = 1.0;
        Similarity2dReport report;
        const Similarity2d fit = fit_similarity_2d(d.markers, {}, report);
        EXPECT_GE(report.doubted, 12);
        EXPECT_LE(report.doubted, 16) << "of the other 48 those whose noise is over three deviations";
        const Vec2 p = d.markers[59].neutral;
        const Vec2 truth{
            static_cast<double>(d.a) * p[0] - static_cast<double>(d.b) * p[1] + static_cast<double>(d.x),
            static_cast<double>(d.b) * p[0] + static_cast<double>(d.a) * p[1] + static_cast<double>(d.y)};
        EXPECT_LT((fit.apply(p) - truth).norm(), 0.2);
    }
}

TEST(Similarity2dProperties, AnyInputEndsFinite) {
    test::SeededRandom random(175);
    const double wild[] = {0.0,          -0.0,     1e6,       -1e6, 1e300,      1e-300,
                           std::nan(""), HUGE_VAL, -HUGE_VAL, 1.0,  1.0 + 1e-15};
    for (int round = 0; round < 20000; ++round) {
        std::vector<PlanarMarker> markers(random.below(12));
        const auto any = [&] {
            return random.chance(0.5) ? wild[random.below(std::size(wild))] : random.uniform(-1e3, 1e3);
        };
        for (PlanarMarker& m : markers) {
            m.neutral = Vec2{any(), any()};
            m.seen = Vec2{any(), any()};
            m.weight = any();
        }
        Similarity2dReport report;
        const Similarity2d fit = fit_similarity_2d(markers, {}, report);
        ASSERT_TRUE(std::isfinite(fit.a) && std::isfinite(fit.b));
        ASSERT_TRUE(std::isfinite(fit.shift[0]) && std::isfinite(fit.shift[1]));
        ASSERT_TRUE(std::isfinite(report.spread));
        if (report.ok) {
            ASSERT_GT(fit.scale(), 0.0);
        }
    }
}

}  // namespace
}  // namespace rig
