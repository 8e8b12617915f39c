#include "firmware_host/companion/files/obj.hpp"

#include <gtest/gtest.h>

#include <string>

namespace rig::host {
namespace {

const std::string kFour = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST(Obj, ReadsPositionsPolygonsAndMaterials) {
    const auto mesh =
        parse_obj("# made by hand\nmtllib x.mtl\no head\n" + kFour +
                      "vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nusemtl skin\ns off\n"
                      "f 1//1 2//1 3//1 4//1\nusemtl eye\nf -4 -3 -2 # the same\nusemtl skin\nf 1 3 4\n",
                  "a.obj");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->positions.size(), 4U);
    EXPECT_EQ(mesh->corners, (std::vector<std::int32_t>{0, 1, 2, 0, 1, 2, 3, 0, 1, 2, 0, 2, 3}));
    EXPECT_EQ(mesh->polygon_sizes, (std::vector<std::int32_t>{3, 4, 3, 3}));
    EXPECT_EQ(mesh->materials, (std::vector<std::string>{"skin", "eye"}));
    EXPECT_EQ(mesh->polygon_material, (std::vector<std::int32_t>{-1, 0, 1, 0}));
}

TEST(Obj, WindowsLineEndsSignsAndColoursPass) {
    const auto mesh =
        parse_obj("v +1.5 -2 3e1 0.5 0.5 0.5\r\nv 0 0 0 1.0\r\nv 0 1 0\r\nf 1 2 3\r\n", "a.obj");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->positions[0], (std::array<double, 3>{1.5, -2.0, 30.0}));
}

struct BadText {
    std::string label;
    std::string text;
    std::string fault;
};

class MalformedObj : public testing::TestWithParam<BadText> {};

TEST_P(MalformedObj, NamesFileLineAndFault) {
    const auto mesh = parse_obj(GetParam().text, "bad.obj");
    ASSERT_FALSE(mesh);
    EXPECT_NE(mesh.error().message.find(GetParam().fault), std::string::npos) << mesh.error().message;
}

INSTANTIATE_TEST_SUITE_P(
    Table, MalformedObj,
    testing::Values(BadText{"empty", "", "bad.obj: the file is empty"},
                    BadText{"comment_only", "# nothing\n", "bad.obj: not an OBJ mesh"},
                    BadText{"no_faces", kFour, "bad.obj: the mesh has no faces"},
                    BadText{"binary",
                            "\x7F"
                            "ELF\x02\x01\x01",
                            "bad.obj:1"},
                    BadText{"cut_vertex", "v 0 0\n", "bad.obj:1: the vertex is cut short"},
                    BadText{"cut_number", kFour + "v 1.5 2 -\nf 1 2 3\n", "bad.obj:5: '-'"},
                    BadText{"nan", "v 0 nan 0\n", "bad.obj:1: 'nan'"},
                    BadText{"infinite", "v 0 0 inf\n", "'inf'"},
                    BadText{"overflow", "v 0 0 1e999\n", "'1e999'"},
                    BadText{"cut_face", kFour + "f 1 2\n", "bad.obj:5: the face is cut short"},
                    BadText{"out_of_range", kFour + "f 1 2 5\n", "bad.obj:5: the face names vertex 5"},
                    BadText{"too_negative", kFour + "f -1 -2 -5\n", "names vertex -5"},
                    BadText{"most_negative", kFour + "f 1 2 -9223372036854775808\n", "bad.obj:5"},
                    BadText{"zero", kFour + "f 0 1 2\n", "names vertex 0"},
                    BadText{"word_corner", kFour + "f 1 2 three\n", "'three'"},
                    BadText{"long_index", kFour + "f 1 2 99999999999999999999\n", "bad.obj:5"},
                    BadText{"bare_material", "usemtl\n", "usemtl without a name"},
                    BadText{"surface", "cstype bezier\n", "'cstype'"}),
    [](const auto& row) { return row.param.label; });

}  // namespace
}  // namespace rig::host
