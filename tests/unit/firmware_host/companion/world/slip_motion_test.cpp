#include "firmware_host/companion/world/slip_motion.hpp"

#include <gtest/gtest.h>

namespace rig::host {
namespace {

TEST(SlipMotion, StartsAtRestAndKeepsItsBounds) {
    for (const SlipKind kind : {SlipKind::kGentle, SlipKind::kHard}) {
        for (std::uint64_t seed = 1; seed <= 5; ++seed) {
            const SlipMotion motion(kind, seed);
            EXPECT_LT(length(motion.at(0.0).translation_mm), 1e-12);
            double farthest_mm = 0.0, widest_rad = 0.0;
            for (int frame = 0; frame < 60 * 120; ++frame) {
                const HeadsetSlip slip = motion.at(frame / 60.0);
                farthest_mm = std::max(farthest_mm, length(slip.translation_mm));
                widest_rad = std::max(widest_rad, length(slip.rotation_rad));
            }
            EXPECT_LE(farthest_mm, motion.bound().translation_mm);
            EXPECT_LE(widest_rad, motion.bound().rotation_rad);
            EXPECT_GT(farthest_mm, 0.2 * motion.bound().translation_mm) << "a slip worth its name";
            EXPECT_GT(widest_rad, 0.2 * motion.bound().rotation_rad);
        }
    }
}

TEST(SlipMotion, JoltsAndDriftAreBothThere) {
    const SlipMotion motion(SlipKind::kGentle, 3);
    double fastest = 0.0, median_sum = 0.0;
    int quiet = 0;
    for (int frame = 1; frame < 3600; ++frame) {
        const double step =
            length(motion.at(frame / 60.0).translation_mm - motion.at((frame - 1) / 60.0).translation_mm);
        fastest = std::max(fastest, step);
        median_sum += step;
        if (step < 0.02) ++quiet;
    }
    EXPECT_GT(fastest, 0.05);  // a jolt
    EXPECT_LT(fastest, 0.6);   // that a camera can follow: no jumps
    EXPECT_GT(quiet, 1800);    // most of the time it creeps
    EXPECT_GT(median_sum, 1.0);
}

TEST(SlipMotion, IsAFunctionOfSeedAndTime) {
    const SlipMotion one(SlipKind::kGentle, 9), same(SlipKind::kGentle, 9), other(SlipKind::kGentle, 10);
    static_cast<void>(one.at(50.0));
    EXPECT_EQ(one.at(7.3).translation_mm, same.at(7.3).translation_mm);
    EXPECT_EQ(one.at(7.3).rotation_rad, same.at(7.3).rotation_rad);
    EXPECT_NE(one.at(7.3).translation_mm, other.at(7.3).translation_mm);
}

TEST(SlipMotion, NoneIsNone) {
    const HeadsetSlip slip = SlipMotion(SlipKind::kNone, 1).at(12.0);
    EXPECT_EQ(slip.apply({1, 2, 3}), (Vec3d{1, 2, 3}));
}

TEST(SlipMotion, AppliesRotationThenTranslation) {
    // A quarter turn about z takes x to y.
    const HeadsetSlip slip{{0, 0, 1.5707963267948966}, {1, 2, 3}};
    const Vec3d moved = slip.apply({10, 0, 0});
    EXPECT_NEAR(moved[0], 1.0, 1e-12);
    EXPECT_NEAR(moved[1], 12.0, 1e-12);
    EXPECT_NEAR(moved[2], 3.0, 1e-12);
}

}  // namespace
}  // namespace rig::host
