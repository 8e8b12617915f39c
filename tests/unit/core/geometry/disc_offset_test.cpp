#include "core/geometry/disc_offset.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/support/random.hpp"

namespace {

using namespace rig;

// Brute force on a true sphere: the disc as many small pieces of skin, each projected.
Vec2 summed(const SkinDisc& disc) {
    const Vec3 n = disc.normal;
    const Vec3 u = n.cross(std::abs(n.x()) < 0.7 ? Vec3(1, 0, 0) : Vec3(0, 1, 0)).normalized();
    const Vec3 v = n.cross(u);
    const double big = 1.0 / disc.curvature_per_mm;
    const Vec3 middle = disc.centre_mm - big * n;
    double area = 0.0;
    Vec2 sum = Vec2::Zero();
    for (int i = 0; i < 200; ++i) {
        const double s = disc.radius_mm * (i + 0.5) / 200;
        for (int j = 0; j < 400; ++j) {
            const double a = 2.0 * std::numbers::pi * (j + 0.5) / 400;
            const Vec3 m = std::cos(s / big) * n + std::sin(s / big) * (std::cos(a) * u + std::sin(a) * v);
            const Vec3 p = middle + big * m;
            const double piece = std::sin(s / big) * -m.dot(p) / std::pow(p.z(), 3);
            area += piece;
            sum += piece * Vec2(p.x() / p.z(), p.y() / p.z());
        }
    }
    return sum / area -
           Vec2(disc.centre_mm.x() / disc.centre_mm.z(), disc.centre_mm.y() / disc.centre_mm.z());
}

TEST(DiscOffset, AgreesWithASumOverASphere) {
    test::SeededRandom random(5);
    double largest = 0.0;
    for (int round = 0; round < 40; ++round) {
        SkinDisc disc;
        disc.centre_mm = Vec3(random.uniform(-40, 40), random.uniform(-40, 40), random.uniform(90, 250));
        disc.radius_mm = random.uniform(1.0, 2.5);
        disc.curvature_per_mm = 1.0 / random.uniform(20.0, 120.0);
        const Vec3 towards = -disc.centre_mm.normalized();
        disc.normal = (towards + 1.2 * Vec3(random.uniform(-1, 1), random.uniform(-1, 1), 0.0)).normalized();
        if (disc.normal.dot(towards) < 0.4) continue;
        const Vec2 found = disc_centroid_offset(disc);
        const Vec2 right = summed(disc);
        EXPECT_NEAR((found - right).norm(), 0.0, 0.03 * right.norm() + 1e-7) << round;
        largest = std::max(largest, right.norm());
    }
    EXPECT_GT(largest * 600.0, 0.05);  // px at a focal length of 600: worth the trouble
}

TEST(DiscOffset, AFlatDiscFacingTheCameraHasNone) {
    const SkinDisc disc{Vec3(0, 0, 150), Vec3(0, 0, -1), 1.5, 0.0};
    EXPECT_NEAR(disc_centroid_offset(disc).norm(), 0.0, 1e-12);
}

TEST(DiscOffset, ATiltedFlatDiscLeansToItsNearSide) {
    // Ellipse of a circle in perspective: its centre is off by f r^2 sin cos / z^2 towards the nearer rim.
    const double tilt = 0.8;
    const SkinDisc disc{Vec3(0, 0, 150), Vec3(std::sin(tilt), 0, -std::cos(tilt)), 1.5, 0.0};
    const Vec2 offset = disc_centroid_offset(disc);
    EXPECT_NEAR(offset.y(), 0.0, 1e-12);
    EXPECT_NEAR(offset.x(), -1.5 * 1.5 * std::sin(tilt) * std::cos(tilt) / (150.0 * 150.0), 1e-7);
}

TEST(DiscOffset, WhatCannotBeSeenHasNone) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const Vec3 ahead(0, 0, 150);
    const Vec3 back(0, 0, -1);
    for (const SkinDisc& disc :
         {SkinDisc{ahead, Vec3(0, 0, 1), 1.5, 0.01}, SkinDisc{Vec3(0, 0, -150), back, 1.5, 0.01},
          SkinDisc{ahead, Vec3::Zero(), 1.5, 0.01}, SkinDisc{ahead, back, 0.0, 0.01},
          SkinDisc{ahead, back, nan, 0.01}, SkinDisc{Vec3(nan, 0, 150), back, 1.5, 0.01},
          SkinDisc{ahead, Vec3(1, 0, 0), 1.5, 0.02}}) {
        EXPECT_EQ(disc_centroid_offset(disc), Vec2(0.0, 0.0));
    }
}

}  // namespace
