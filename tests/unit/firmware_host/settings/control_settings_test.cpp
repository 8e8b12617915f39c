#include "firmware_host/settings/control_settings.hpp"

#include <gtest/gtest.h>

#include <array>

namespace rig {
namespace {

constexpr std::array<std::string_view, 7> kNames{"browDown_L", "browDown_R", "jaw.open",  "jawLeft",
                                                 "jawRight",   "eyeBlink_L", "eyeBlink_R"};

std::vector<ControlEdit> edits_of(std::string_view line) {
    const auto edits = parse_control(line, kNames);
    EXPECT_TRUE(edits.has_value()) << edits.error();
    return edits.value_or(std::vector<ControlEdit>{});
}

std::string fault_of(std::string_view line) {
    const auto edits = parse_control(line, kNames);
    return edits ? "" : edits.error();
}

TEST(ControlSettings, RegionsAndNames) {
    ControlEdit brows{ControlKind::kSparsity, 2.5F, 0.0F, 0, 0, {}};
    put_in(brows.shapes, 0);
    put_in(brows.shapes, 1);
    EXPECT_EQ(edits_of("brows.sparsity=2.5"), std::vector{brows});
    ControlEdit one{ControlKind::kRange, -0.25F, 0.75F, 0, 0, {}};
    put_in(one.shapes, 2);
    EXPECT_EQ(edits_of("jaw.open.range=-0.25,0.75"), std::vector{one}) << "a dot belongs to the name";
    EXPECT_EQ(edits_of("jaw.open.range=-0.25, 0.75 "), std::vector{one});
    EXPECT_TRUE(edits_of("nose.offset=0.1").empty());
}

TEST(ControlSettings, EachWordHasItsKind) {
    const std::array<std::pair<std::string_view, ControlKind>, 5> words{
        {{"sparsity", ControlKind::kSparsity},
         {"ridge", ControlKind::kRidge},
         {"temporal", ControlKind::kTemporal},
         {"multiplier", ControlKind::kMultiplier},
         {"offset", ControlKind::kOffset}}};
    for (const auto& [word, kind] : words)
        EXPECT_EQ(edits_of("all." + std::string(word) + "=0.5").at(0).kind, kind);
}

TEST(ControlSettings, SymmetryTiesSides) {
    const ControlEdit brows{ControlKind::kSymmetry, 10.0F, 0.0F, 0, 1, {}};
    const ControlEdit lids{ControlKind::kSymmetry, 10.0F, 0.0F, 5, 6, {}};
    EXPECT_EQ(edits_of("all.symmetry=10"), (std::vector{brows, lids}));
    EXPECT_EQ(edits_of("left.symmetry=10"), (std::vector{brows, lids}));
    EXPECT_EQ(edits_of("lids.symmetry=10"), std::vector{lids});
    EXPECT_TRUE(edits_of("jaw.symmetry=10").empty()) << "jawLeft is on no side";
    EXPECT_EQ(edits_of("jawLeft,jawRight.symmetry=10"),
              (std::vector{ControlEdit{ControlKind::kSymmetry, 10.0F, 0.0F, 3, 4, {}}}));
}

TEST(ControlSettings, CancelIsOfTwoShapes) {
    EXPECT_EQ(edits_of("jawLeft,jawRight.cancel=1"),
              (std::vector{ControlEdit{ControlKind::kCancel, 1.0F, 0.0F, 3, 4, {}}}));
    for (const char* wrong :
         {"jaw.cancel=1", "jawLeft,ear.cancel=1", "jawLeft,jawLeft.cancel=1", "jawLeft,jawRight.cancel=0.5"})
        EXPECT_NE(fault_of(wrong), "") << wrong;
}

TEST(ControlSettings, RefusesWithTheLine) {
    for (const char* wrong :
         {"", "brows", "brows.sparsity", "brows=2", "brows.shine=2", "ears.ridge=1",
          "brows.ridge=", "brows.ridge=two", "brows.ridge=1x", "brows.ridge=-1", "brows.ridge=nan",
          "brows.ridge=10001", "brows.range=0.5", "brows.range=0.5,0.25", "brows.range=0,inf",
          "nose.ridge=-1", "brows.offset=1,2"}) {
        EXPECT_NE(fault_of(wrong), "") << wrong;
        EXPECT_NE(fault_of(wrong).find(std::string("'") + wrong + "'"), std::string::npos) << wrong;
    }
}

TEST(ControlSettings, LinesKeepTheirOrder) {
    const std::vector<std::string> lines{"all.ridge=2", "jawLeft.ridge=3"};
    const auto edits = parse_controls(lines, kNames);
    ASSERT_TRUE(edits.has_value());
    ASSERT_EQ(edits->size(), 2U);
    EXPECT_EQ((*edits)[1].value, 3.0F);
    EXPECT_FALSE(parse_controls(std::vector<std::string>{"all.ridge=2", "x"}, kNames).has_value());
}

}  // namespace
}  // namespace rig
