#include "firmware_host/companion/train/marker_sets.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "firmware_host/companion/sample/sample.hpp"
#include "tests/support/shared_data.hpp"

namespace rig::host {
namespace {

void expect_levels(const std::vector<MarkerSet>& sets, std::size_t markers) {
    std::set<std::string> names;
    std::array<std::set<std::uint16_t>, 3> seen;
    std::uint8_t level = 0;
    for (const MarkerSet& set : sets) {
        EXPECT_TRUE(names.insert(set.name).second) << set.name;
        EXPECT_GE(set.level, level) << "levels rise";
        level = set.level;
        ASSERT_LE(level, 2);
        EXPECT_GE(set.markers.size(), std::min<std::size_t>(4, markers)) << set.name;
        EXPECT_TRUE(std::ranges::is_sorted(set.markers)) << set.name;
        for (const std::uint16_t k : set.markers) {
            EXPECT_LT(k, markers);
            seen[level].insert(k);
        }
        for (const MarkerSet& other : sets) {
            if (&other != &set) {
                EXPECT_NE(other.markers, set.markers) << set.name << " " << other.name;
            }
        }
    }
    EXPECT_EQ(seen[0].size(), markers);
}

TEST(MarkerSets, OfTheSampleAreTheSourcesTwentyOne) {
    const Rig rig = sample_rig();
    const MarkerLayout layout = sample_layout(rig);
    const std::vector<MarkerSet> sets = marker_sets(layout);
    expect_levels(sets, layout.markers.size());
    EXPECT_EQ(sets.size(), 21U);
    EXPECT_EQ(std::ranges::count(sets, 1, &MarkerSet::level), 4);
    for (const std::uint8_t level : {1, 2}) {
        std::set<std::uint16_t> covered;
        for (const MarkerSet& set : sets) {
            if (set.level == level) covered.insert(set.markers.begin(), set.markers.end());
        }
        EXPECT_EQ(covered.size(), layout.markers.size())
            << "every marker is in a set of level " << int{level};
    }
}

TEST(MarkerSets, LieWhereTheirNamesSay) {
    const Rig rig = sample_rig();
    const MarkerLayout layout = sample_layout(rig);
    std::map<std::string, std::array<double, 2>> centre;
    for (const MarkerSet& set : marker_sets(layout)) {
        for (const std::uint16_t k : set.markers) {
            for (std::size_t axis = 0; axis < 2; ++axis)
                centre[set.name][axis] += static_cast<double>(layout.markers[k].neutral_mm[axis]) /
                                          static_cast<double>(set.markers.size());
        }
    }
    EXPECT_GT(centre["left_eye"][0], 10.0) << "+x is the performer's left";
    EXPECT_LT(centre["right_eye"][0], -10.0);
    EXPECT_GT(centre["left_mouth_corner"][0], centre["right_mouth_corner"][0] + 10.0);
    EXPECT_GT(centre["forehead"][1], centre["nose"][1]);
    EXPECT_GT(centre["nose"][1], centre["mouth"][1]);
    EXPECT_GT(centre["upper_lip"][1], centre["lower_lip"][1]);
    EXPECT_GT(centre["lower_lip"][1], centre["chin"][1]);
}

TEST(MarkerSets, OfSparseLayoutsAreFewerAndNeverTheSameTwice) {
    const Rig rig = sample_rig();
    MarkerLayout layout = sample_layout(rig);
    for (const std::size_t markers : {1U, 4U, 5U, 9U, 20U}) {
        layout.markers.resize(markers);
        std::vector<MarkerSet> sets = marker_sets(layout);
        expect_levels(sets, markers);
        if (markers <= 4) {
            EXPECT_EQ(sets.size(), 1U);
        }
        layout = sample_layout(rig);
    }
}

TEST(MarkerSets, OfTheRecordedLayoutsAreWhole) {
    RIG_SHARED_DATA_OR_SKIP(folder, "rig");
    const auto rig = load_rig(folder);
    ASSERT_TRUE(rig.has_value()) << rig.error().message;
    for (const char* name : {"50", "60", "102"}) {
        const auto layout = load_layout(folder, name, *rig);
        ASSERT_TRUE(layout.has_value()) << layout.error().message;
        const std::vector<MarkerSet> sets = marker_sets(*layout);
        expect_levels(sets, layout->markers.size());
        EXPECT_EQ(sets.size(), 21U) << name;
    }
}

}  // namespace
}  // namespace rig::host
