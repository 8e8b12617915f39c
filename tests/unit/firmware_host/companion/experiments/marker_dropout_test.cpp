#include "firmware_host/companion/experiments/marker_dropout.hpp"

#include <gtest/gtest.h>

#include <array>

#include "firmware_host/companion/sample/sample.hpp"

namespace rig::host {
namespace {

TEST(MarkerDropout, BurstsHideTheShareAskedForInRunsAndNothingAtFirst) {
    const MarkerLayout layout = sample_layout(sample_rig());
    for (const double share : {0.0, 0.05, 0.3}) {
        const DropoutMask mask = burst_dropout(layout, 400, share, 3);
        EXPECT_NEAR(mask.share(), share, 1e-3);
        std::size_t runs = 0;
        std::size_t hidden = 0;
        for (std::size_t k = 0; k < layout.markers.size(); ++k) {
            EXPECT_FALSE(mask.at(0, k));
            for (std::size_t f = 1; f < 400; ++f) {
                hidden += mask.at(f, k) ? 1 : 0;
                runs += mask.at(f, k) && !mask.at(f - 1, k) ? 1 : 0;
            }
        }
        EXPECT_GE(hidden, 8 * runs) << "bursts, not single frames";
        EXPECT_EQ(burst_dropout(layout, 400, share, 3).hidden, mask.hidden) << "the same from the same seed";
    }
}

TEST(MarkerDropout, SetsAreHiddenWholeForHalfOfTheTime) {
    const std::array<std::uint16_t, 2> set{1, 3};
    const DropoutMask mask = set_dropout(set, 120, 5);
    for (std::size_t f = 0; f < 120; ++f) {
        for (std::size_t k = 0; k < 5; ++k)
            EXPECT_EQ(mask.at(f, k), (k == 1 || k == 3) && f % 60 >= 30) << f << " " << k;
    }
}

TEST(MarkerDropout, NearTotalLeavesAsManyAsAsked) {
    const DropoutMask mask = near_total_dropout(4, 100, 20, 5);
    for (std::size_t f = 0; f < 100; ++f) {
        std::size_t seen = 0;
        for (std::size_t k = 0; k < 20; ++k) seen += mask.at(f, k) ? 0 : 1;
        EXPECT_EQ(seen, f == 0 ? 20U : 4U);
    }
}

// One marker that moves by 1 mm a frame, hidden in frames 2 to 4 and from 8 on.
TEST(MarkerDropout, GapsAreHeldOrBridged) {
    DropoutMask mask{10, 1, std::vector<char>(10, 0)};
    for (const std::size_t f : {2, 3, 4, 8, 9}) mask.hidden[f] = 1;
    std::vector<Vec3> positions;
    for (int f = 0; f < 10; ++f)
        positions.push_back(mask.hidden[static_cast<std::size_t>(f)] != 0 ? Vec3{1e9, 1e9, 1e9}
                                                                          : Vec3{1.0 * f, 0.0, 0.0});
    const std::vector<Vec3> held = held_last(positions, mask);
    const std::vector<Vec3> line = interpolated(positions, mask);
    const std::array<double, 10> wanted_held{0, 1, 1, 1, 1, 5, 6, 7, 7, 7};
    const std::array<double, 10> wanted_line{0, 1, 2, 3, 4, 5, 6, 7, 7, 7};
    for (std::size_t f = 0; f < 10; ++f) {
        EXPECT_NEAR(held[f][0], wanted_held[f], 1e-12) << f;
        EXPECT_NEAR(line[f][0], wanted_line[f], 1e-12) << f;
    }
}

}  // namespace
}  // namespace rig::host
