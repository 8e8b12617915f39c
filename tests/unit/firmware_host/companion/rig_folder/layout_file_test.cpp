#include "firmware_host/companion/rig_folder/layout_file.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/limits.hpp"
#include "firmware_host/companion/files/whole_file.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/firmware_host/companion/rig_folder/small_rig.hpp"

namespace rig::host {
namespace {

TEST(Layout, LoadsWhatItSavesByCountAndByPath) {
    const rig::test::TempFolder folder;
    const Rig rig = rig::test::small_rig();
    const MarkerLayout layout = rig::test::small_layout(rig);
    ASSERT_TRUE(save_layout(folder.path(), layout, rig));
    for (const std::string& which : {std::string{"5"}, (folder / "markers_5.csv").string()}) {
        const auto back = load_layout(folder.path(), which, rig);
        ASSERT_TRUE(back) << back.error().message;
        ASSERT_EQ(back->markers.size(), 5U);
        EXPECT_EQ(back->markers[4].name, "E");
        EXPECT_EQ(back->markers[4].vertices, (Int3{0, 1, 4}));
        EXPECT_EQ(back->markers[4].barycentric, layout.markers[4].barycentric);
        EXPECT_EQ(back->markers[4].neutral_mm, layout.markers[4].neutral_mm);
    }
}

TEST(Layout, WritesTheModelBesideIt) {
    const rig::test::TempFolder folder;
    const Rig rig = rig::test::small_rig();
    const MarkerLayout layout = rig::test::small_layout(rig);
    ASSERT_TRUE(save_layout(folder.path(), layout, rig));
    const MarkerModel model = marker_model(rig, layout);
    const auto basis = read_npy<float>(folder / "markers_5_B.npy");
    const auto neutral = read_npy<float>(folder / "markers_5_neutral.npy");
    ASSERT_TRUE(basis && neutral);
    EXPECT_EQ(basis->shape, (std::vector<std::size_t>{15, 2}));
    EXPECT_EQ(basis->values, model.basis_mm);
    EXPECT_EQ(neutral->values, model.neutral_mm);
}

TEST(Layout, NumberAndPositionColumnsMayBeAbsent) {
    const Rig rig = rig::test::small_rig();
    const auto layout = parse_layout(
        "name,v0,v1,v2,b0,b1,b2,nx,ny,nz\nA,0,1,4,0.5,0.25,0.25,0,0,1\nB,2,2,2,1,0,0,0,0,1\n"
        "C,8,8,8,1,0,0,0,0,1\nD,6,6,6,1,0,0,0,0,1\n",
        "l.csv", rig);
    ASSERT_TRUE(layout) << layout.error().message;
    EXPECT_FLOAT_EQ(layout->markers[0].neutral_mm[0], 5.0F);
}

TEST(Layout, OffsetsAreColumnsOfTheirOwn) {
    const rig::test::TempFolder folder;
    const Rig rig = rig::test::small_rig();
    MarkerLayout layout = rig::test::small_layout(rig);
    ASSERT_TRUE(save_layout(folder.path(), layout, rig));
    const auto plain = read_whole_text(folder / "markers_5.csv");
    ASSERT_TRUE(plain);
    EXPECT_EQ(plain->find("ox_mm"), std::string::npos);
    const MarkerModel before = marker_model(rig, layout);
    layout.markers[2].offset_mm = {0.5F, -1.25F, 2.0F};
    ASSERT_TRUE(save_layout(folder.path(), layout, rig));
    const auto back = load_layout(folder.path(), "5", rig);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->markers[2].offset_mm, layout.markers[2].offset_mm);
    EXPECT_EQ(back->markers[1].offset_mm, Float3{});
    EXPECT_EQ(back->markers[2].neutral_mm, layout.markers[2].neutral_mm);
    const MarkerModel after = marker_model(rig, *back);
    EXPECT_EQ(after.basis_mm, before.basis_mm);
    EXPECT_FLOAT_EQ(after.neutral_mm[7], before.neutral_mm[7] - 1.25F);
    EXPECT_EQ(after.neutral_mm[3], before.neutral_mm[3]);
    layout.markers[2].offset_mm = {0.0F, 0.0F, 25.0F};
    const auto far = save_layout(folder.path(), layout, rig);
    ASSERT_FALSE(far);
    EXPECT_NE(far.error().message.find("offset"), std::string::npos);
}

struct BadLayout {
    std::string label;
    std::string text;
    std::string fault;
};

const std::string kHeader = "marker,name,v0,v1,v2,b0,b1,b2,x_mm,y_mm,z_mm,nx,ny,nz\n";
const std::string kThree =
    "0,A,0,0,0,1,0,0,0,0,0,0,0,1\n1,B,2,2,2,1,0,0,20,0,0,0,0,1\n2,C,8,8,8,1,0,0,20,20,0,0,0,1\n";
const std::string kFourth = "3,D,6,6,6,1,0,0,0,20,0,0,0,1\n";

std::string too_many() {
    std::string text = kHeader;
    for (std::size_t m = 0; m <= kMaxMarkers; ++m) {
        text += std::to_string(m) + ",N" + std::to_string(m) + ",0,0,0,1,0,0,0,0,0,0,0,1\n";
    }
    return text;
}

class MalformedLayout : public testing::TestWithParam<BadLayout> {};

TEST_P(MalformedLayout, NamesFileAndFault) {
    const Rig rig = rig::test::small_rig();
    ASSERT_TRUE(parse_layout(kHeader + kThree + kFourth, "good.csv", rig));
    const auto layout = parse_layout(GetParam().text, "bad.csv", rig);
    ASSERT_FALSE(layout);
    EXPECT_NE(layout.error().message.find("bad.csv"), std::string::npos) << layout.error().message;
    EXPECT_NE(layout.error().message.find(GetParam().fault), std::string::npos) << layout.error().message;
}

INSTANTIATE_TEST_SUITE_P(
    Table, MalformedLayout,
    testing::Values(
        BadLayout{"empty", "", "empty"}, BadLayout{"header_only", kHeader, "no marker"},
        BadLayout{"too_few", kHeader + kThree, "at least 4"},
        BadLayout{"too_many", too_many(), "more than 128"},
        BadLayout{"no_name_column", "marker,v0\n0,1\n", "'name' is missing"},
        BadLayout{"no_vertex_column", "name,v0,v1\nA,1,1\n", "'v2' is missing"},
        BadLayout{"cut_line", kHeader + kThree + "3,D,6,6", "bad.csv:5"},
        BadLayout{"order", kHeader + "1,A,0,0,0,1,0,0,0,0,0,0,0,1\n", "marker 1 stands"},
        BadLayout{"twice", kHeader + kThree + "3,A,6,6,6,1,0,0,0,20,0,0,0,1\n", "named 'A'"},
        BadLayout{"nameless", kHeader + kThree + "3,,6,6,6,1,0,0,0,20,0,0,0,1\n", "cannot be the name"},
        BadLayout{"range", kHeader + kThree + "3,D,6,6,9,1,0,0,0,20,0,0,0,1\n", "vertex 9"},
        BadLayout{"negative", kHeader + kThree + "3,D,-6,6,6,1,0,0,0,20,0,0,0,1\n", "vertex -6"},
        BadLayout{"fraction", kHeader + kThree + "3,D,6.5,6,6,1,0,0,0,20,0,0,0,1\n", "integer"},
        BadLayout{"nan", kHeader + kThree + "3,D,6,6,6,1,0,0,0,nan,0,0,0,1\n", "finite"},
        BadLayout{"sum", kHeader + kThree + "3,D,6,6,6,0.5,0,0,0,20,0,0,0,1\n", "sum to 1"},
        BadLayout{"outside", kHeader + kThree + "3,D,6,6,6,2,-1,0,0,20,0,0,0,1\n", "0..1"},
        BadLayout{"other_head", kHeader + kThree + "3,D,6,6,6,1,0,0,0,21,0,0,0,1\n", "another head"},
        BadLayout{"normal", kHeader + kThree + "3,D,6,6,6,1,0,0,0,20,0,0,0,0\n", "unit length"}),
    [](const auto& row) { return row.param.label; });

TEST(Layout, MissingFileIsNamed) {
    const Rig rig = rig::test::small_rig();
    const auto layout = load_layout("some/folder", "60", rig);
    ASSERT_FALSE(layout);
    EXPECT_NE(layout.error().message.find("markers_60.csv"), std::string::npos);
}

}  // namespace
}  // namespace rig::host
