#include "core/geometry/triangulation.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/support/random.hpp"

namespace rig {
namespace {

Sighting ray_to(const Vec3& from, const Vec3& target, double information) {
    return {from, (target - from).normalized(), information};
}

TEST(Triangulation, TwoRaysMeet) {
    test::SeededRandom random(31);
    for (int i = 0; i < 200; ++i) {
        const Vec3 target{random.uniform(-70.0, 70.0), random.uniform(-100.0, 60.0),
                          random.uniform(-60.0, 30.0)};
        const std::array<Sighting, 2> rays{ray_to({-70.0, -45.0, 200.0}, target, 250.0),
                                           ray_to({70.0, -45.0, 200.0}, target, 250.0)};
        const Vec3 guess = target + Vec3{1.0, -1.0, 2.0};
        const Triangulation met = triangulate(rays, guess, 1e-9);
        EXPECT_LT((met.position_mm - target).norm(), 1e-7);
        EXPECT_LT(met.gap_mm, 2e-5);  // a root of a cancelled square: half the digits
        EXPECT_GT(met.information.determinant(), 0.0);
    }
}

TEST(Triangulation, SkewRaysMeetHalfwayAndTellTheGap) {
    // Two perpendicular rays 0.6 mm apart at their nearest points.
    const std::array<Sighting, 2> rays{Sighting{{0.0, 0.0, 0.3}, {1.0, 0.0, 0.0}, 100.0},
                                       Sighting{{0.0, 0.0, -0.3}, {0.0, 1.0, 0.0}, 100.0}};
    const Triangulation equal = triangulate(rays, Vec3{0.1, -0.1, 0.0}, 1e-9);
    EXPECT_LT((equal.position_mm - Vec3{0.0, 0.0, 0.0}).norm(), 1e-9);
    EXPECT_NEAR(equal.gap_mm, 0.3, 1e-9);
    // Three times the information on the first: the point divides the gap 1 to 3.
    std::array<Sighting, 2> unequal = rays;
    unequal[0].information = 300.0;
    const Triangulation pulled = triangulate(unequal, Vec3::Zero(), 1e-9);
    EXPECT_NEAR(pulled.position_mm[2], 0.15, 1e-9);
    EXPECT_NEAR(pulled.gap_mm, 0.45, 1e-9);
}

TEST(Triangulation, OneRayTakesTheExpectedDepth) {
    test::SeededRandom random(33);
    for (int i = 0; i < 100; ++i) {
        const Vec3 target{random.uniform(-50.0, 50.0), random.uniform(-50.0, 50.0),
                          random.uniform(-50.0, 20.0)};
        const std::array<Sighting, 1> rays{ray_to({0.0, -40.0, 210.0}, target, 250.0)};
        const Vec3 expected = target + 4.0 * rays[0].direction + Vec3{0.3, -0.2, 0.1};
        const Triangulation found = triangulate(rays, expected, 1e-6);
        // On the ray, at the foot of the expected position.
        EXPECT_LT(found.gap_mm, 2e-5);
        EXPECT_NEAR((found.position_mm - expected).dot(rays[0].direction), 0.0, 1e-4);
        // Nothing is claimed to be known along the ray.
        EXPECT_NEAR(found.information.determinant(), 0.0, 1e-6);
        EXPECT_NEAR((found.information * rays[0].direction).norm(), 0.0, 1e-10);
        EXPECT_NEAR(found.information.trace(), 500.0, 1e-9);
    }
}

TEST(Triangulation, APointIsItself) {
    const Vec3 point{12.0, -30.0, 5.0};
    const std::array<Sighting, 1> seen{Sighting{point, Vec3::Zero(), 100.0}};
    const Triangulation found = triangulate(seen, point + Vec3{2.0, 2.0, 2.0}, 1e-9);
    EXPECT_LT((found.position_mm - point).norm(), 1e-9);
    EXPECT_LT((found.information - 100.0 * Mat3::Identity()).norm(), 1e-12);
}

TEST(Triangulation, ErrorOfTheAnswerHasTheStatedInformation) {
    // Rays through a noisy pixel plane: the spread of the answers is the inverse of the information, within
    // sampling.
    test::SeededRandom random(34);
    const Vec3 target{10.0, -20.0, 5.0};
    const std::array<Vec3, 2> centres{Vec3{-70.0, -45.0, 200.0}, Vec3{70.0, -45.0, 200.0}};
    constexpr double kSigmaMm = 0.05;
    constexpr int kSamples = 4000;
    Mat3 spread = Mat3::Zero();
    Mat3 claimed = Mat3::Zero();
    for (int i = 0; i < kSamples; ++i) {
        std::array<Sighting, 2> rays;
        for (std::size_t c = 0; c < 2; ++c) {
            const Vec3 shaken = target + Vec3{random.normal(0.0, kSigmaMm), random.normal(0.0, kSigmaMm),
                                              random.normal(0.0, kSigmaMm)};
            rays[c] = ray_to(centres[c], shaken, 1.0 / (kSigmaMm * kSigmaMm));
        }
        const Triangulation found = triangulate(rays, target, 1e-9);
        const Vec3 error = found.position_mm - target;
        spread += error * error.transpose() / kSamples;
        claimed = found.information;
    }
    const Mat3 product = spread * claimed;
    EXPECT_LT((product - Mat3::Identity()).cwiseAbs().maxCoeff(), 0.12);
}

TEST(Triangulation, InverseOfAMatrix) {
    test::SeededRandom random(35);
    for (int i = 0; i < 100; ++i) {
        Mat3 a;
        for (Eigen::Index r = 0; r < 3; ++r) {
            for (Eigen::Index c = 0; c < 3; ++c) a(r, c) = random.normal(0.0, 1.0);
        }
        const Mat3 spd = a * a.transpose() + 0.1 * Mat3::Identity();
        const Mat3 product = spd * inverse_3x3(spd);
        EXPECT_LT((product - Mat3::Identity()).cwiseAbs().maxCoeff(), 1e-11);
    }
}

}  // namespace
}  // namespace rig
