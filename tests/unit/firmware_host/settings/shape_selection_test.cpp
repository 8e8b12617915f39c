#include "firmware_host/settings/shape_selection.hpp"

#include <gtest/gtest.h>

#include <array>

namespace rig {
namespace {

constexpr std::array<std::string_view, 12> kNames{
    "browDown_L", "browDown_R",   "eyeBlinkLeft", "eyeBlinkRight", "jawOpen",   "jawLeft",
    "jawRight",   "mouthSmile_R", "mouthSmile_L", "noseSneer_L",   "L_LipCurl", "cheekPuff"};
using Indices = std::vector<std::size_t>;

TEST(ShapeSelection, RegionsArePatternsOnNames) {
    EXPECT_EQ(select_shapes("brows", kNames).value(), (Indices{0, 1}));
    EXPECT_EQ(select_shapes("lids", kNames).value(), (Indices{2, 3}));
    EXPECT_EQ(select_shapes("jaw", kNames).value(), (Indices{4, 5, 6}));
    EXPECT_EQ(select_shapes("mouth", kNames).value(), (Indices{7, 8, 10}));
    EXPECT_EQ(select_shapes("nose", kNames).value(), (Indices{9}));
    EXPECT_EQ(select_shapes("cheeks", kNames).value(), (Indices{11}));
    EXPECT_EQ(select_shapes("all", kNames)->size(), kNames.size());
}

TEST(ShapeSelection, SidesLeaveOutWhatMovesTheWholeJaw) {
    EXPECT_EQ(select_shapes("left", kNames).value(), (Indices{0, 2, 8, 9, 10}));
    EXPECT_EQ(select_shapes("right", kNames).value(), (Indices{1, 3, 7}));
}

TEST(ShapeSelection, ANameMeansItself) {
    EXPECT_EQ(select_shapes("jawLeft", kNames).value(), (Indices{5}));
    constexpr std::array<std::string_view, 2> kOdd{"jaw", "jawOpen"};
    EXPECT_EQ(select_shapes("jaw", kOdd).value(), (Indices{0}));
}

TEST(ShapeSelection, RefusesWhatIsNeither) {
    const auto refused = select_shapes("jawopen", kNames);
    ASSERT_FALSE(refused.has_value());
    EXPECT_NE(refused.error().find("jawopen"), std::string::npos);
    EXPECT_NE(refused.error().find("brows"), std::string::npos);
    EXPECT_TRUE(select_shapes("nose", std::span(kNames).first(3)).value().empty());
}

TEST(ShapeSelection, PairsLeftWithRight) {
    EXPECT_EQ(side_pairs(kNames), (std::vector<SidePair>{{0, 1}, {2, 3}, {8, 7}}));
}

}  // namespace
}  // namespace rig
