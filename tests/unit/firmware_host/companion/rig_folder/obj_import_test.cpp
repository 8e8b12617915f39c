#include "firmware_host/companion/rig_folder/obj_import.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "core/limits.hpp"
#include "firmware_host/companion/files/whole_file.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::host {
namespace {

namespace fs = std::filesystem;

const std::string kNeutral =
    "v 0 0 0\nv 10 0 0\nv 10 10 0\nv 0 10 0\nv 5 5 4\nusemtl skin\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\nf 4 3 "
    "2 1\n";
const std::string kSmile =
    "v 0 0 0\nv 10 0 0.25\nv 10 10 0.001\nv 0 10 0\nv 5 6 4\nusemtl skin\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 "
    "5\nf 4 3 2 1\n";
const std::string kMarkers = "name,vertex\nA,0\nB,1\nC,2\nD,4\n";

void put(const fs::path& path, const std::string& text) {
    ASSERT_TRUE(write_whole_text(path, text));
}

void put_good_folder(const fs::path& folder) {
    put(folder / "neutral.obj", kNeutral);
    put(folder / "smile.obj", kSmile);
    put(folder / "frown.obj", kNeutral);
    put(folder / "markers.csv", kMarkers);
    put(folder / "notes.txt", "not a mesh");
}

Result<ImportedRig, FileError> import_from(const fs::path& folder, double mm_per_unit = 1.0) {
    return import_obj_folder({.folder = folder,
                              .neutral = "neutral.obj",
                              .markers = folder / "markers.csv",
                              .mm_per_unit = mm_per_unit});
}

TEST(ObjImport, MakesShapesFromDifferences) {
    const rig::test::TempFolder folder;
    put_good_folder(folder.path());
    const auto imported = import_from(folder.path());
    ASSERT_TRUE(imported) << imported.error().message;
    const Rig& rig = imported->rig;
    EXPECT_EQ(rig.vertices_mm.size(), 5U);
    EXPECT_EQ(rig.triangles.size(), 6U);  // the quad became two
    EXPECT_EQ(rig.triangles[5], (Int3{3, 1, 0}));
    EXPECT_EQ(rig.parts, std::vector<std::string>{"skin"});
    ASSERT_EQ(rig.shapes.size(), 2U);
    EXPECT_EQ(rig.shapes[0].name, "frown");
    EXPECT_TRUE(rig.shapes[0].vertices.empty());
    EXPECT_EQ(rig.shapes[1].name, "smile");
    EXPECT_EQ(rig.shapes[1].vertices, (std::vector<std::int32_t>{1, 4}));  // 0.001 mm was folded away
    EXPECT_EQ(rig.shapes[1].delta_mm[1], (Float3{0, 1, 0}));
    EXPECT_EQ(imported->layout.markers[3].neutral_mm, (Float3{5, 5, 4}));
    EXPECT_GT(imported->layout.markers[3].normal[2], 0.99F);
}

TEST(ObjImport, ScalesEverything) {
    const rig::test::TempFolder folder;
    put_good_folder(folder.path());
    put(folder / "markers.csv", "name,x,y,z\nA,0,0,0\nB,10,0,0\nC,10,10,0\nD,5,5,4.5\n");
    const auto imported = import_from(folder.path(), 10.0);
    ASSERT_TRUE(imported) << imported.error().message;
    EXPECT_EQ(imported->rig.vertices_mm[4], (Float3{50, 50, 40}));
    EXPECT_EQ(imported->rig.shapes[1].delta_mm.back(), (Float3{0, 10, 0}));
    EXPECT_NEAR(imported->layout.markers[3].neutral_mm[2], 40.0F, 1e-4F);
}

TEST(ObjImport, PointsAreProjectedAndMayMixWithVertices) {
    const rig::test::TempFolder folder;
    put_good_folder(folder.path());
    put(folder / "markers.csv", "name,vertex,x,y,z\nA,0,,,\nB,1,,,\nC,2,,,\nD,,5,2,9\n");
    const auto imported = import_from(folder.path());
    ASSERT_TRUE(imported) << imported.error().message;
    const LayoutMarker& marker = imported->layout.markers[3];
    EXPECT_NEAR(marker.barycentric[0] + marker.barycentric[1] + marker.barycentric[2], 1.0F, 1e-6F);
    // On the front slope 0.8 y = z, and on the line through the point at right angles to it.
    EXPECT_NEAR(marker.neutral_mm[2], 0.8F * marker.neutral_mm[1], 1e-4F);
}

struct Damage {
    std::string label;
    std::string file;
    std::string fault;
    std::string text;  // of the file; "-" removes it
};

class MalformedObjFolder : public testing::TestWithParam<Damage> {};

TEST_P(MalformedObjFolder, NamesFileAndFault) {
    const rig::test::TempFolder folder;
    put_good_folder(folder.path());
    const Damage& damage = GetParam();
    damage.text == "-" ? void(fs::remove(folder / damage.file)) : put(folder / damage.file, damage.text);
    const auto imported = import_from(folder.path());
    ASSERT_FALSE(imported);
    EXPECT_NE(imported.error().message.find(damage.file), std::string::npos) << imported.error().message;
    EXPECT_NE(imported.error().message.find(damage.fault), std::string::npos) << imported.error().message;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
}

std::string listed(std::size_t count) {
    std::string text = "name,vertex\n";
    for (std::size_t i = 0; i < count; ++i) text += "N" + std::to_string(i) + ",0\n";
    return text;
}

INSTANTIATE_TEST_SUITE_P(
    Table, MalformedObjFolder,
    testing::Values(
        Damage{"no_neutral", "neutral.obj", "cannot be opened", "-"},
        Damage{"no_markers", "markers.csv", "cannot be opened", "-"},
        Damage{"empty_neutral", "neutral.obj", "empty", ""}, Damage{"empty_shape", "smile.obj", "empty", ""},
        Damage{"fewer_vertices", "smile.obj", "4 vertices",
               "v 0 0 0\nv 10 0 0\nv 10 10 0\nv 0 10 0\nf 1 2 3\n"},
        Damage{"other_faces", "smile.obj", "faces are not those", replaced(kSmile, "f 1 2 5", "f 1 2 4")},
        Damage{"cut_file", "smile.obj", "faces are not those", kSmile.substr(0, kSmile.find("f 4 1 5"))},
        Damage{"cut_line", "smile.obj", "smile.obj:11", kSmile.substr(0, kSmile.size() - 6)},
        Damage{"other_order", "frown.obj", "faces are not those",
               replaced(kNeutral, "f 4 3 2 1", "f 3 4 1 2")},
        Damage{"nan", "smile.obj", "smile.obj:2", replaced(kSmile, "0.25", "nan")},
        Damage{"face_range", "neutral.obj", "names vertex 50", replaced(kNeutral, "f 1 2 5", "f 1 2 50")},
        Damage{"too_far", "neutral.obj", "100 m", replaced(kNeutral, "v 10 0 0", "v 1e9 0 0")},
        Damage{"moved_too_far", "smile.obj", "100 m", replaced(kSmile, "0.25", "1e9")},
        Damage{"empty_list", "markers.csv", "empty", ""},
        Damage{"few_markers", "markers.csv", "at least 4", listed(3)},
        Damage{"same_marker", "markers.csv", "named 'A'", "name,vertex\nA,0\nA,1\nC,2\nD,3\n"},
        Damage{"marker_range", "markers.csv", "markers.csv:2: vertex 5", "name,vertex\nA,5\n"},
        Damage{"marker_negative", "markers.csv", "vertex -1", "name,vertex\nA,-1\n"},
        Damage{"marker_cut", "markers.csv", "markers.csv:3", "name,vertex\nA,1\nB"},
        Damage{"marker_columns", "markers.csv", "name,vertex or name,x,y,z", "name,x,y\nA,1,2\n"},
        Damage{"marker_nan", "markers.csv", "finite", "name,x,y,z\nA,1,nan,2\n"},
        Damage{"marker_far", "markers.csv", "mm off the surface", "name,x,y,z\nA,1,100,2\n"},
        Damage{"too_many_markers", "markers.csv", "more than 128", listed(kMaxMarkers + 1)}),
    [](const auto& row) { return row.param.label; });

TEST(ObjImport, AFolderWithoutShapesIsNamed) {
    const rig::test::TempFolder folder;
    put_good_folder(folder.path());
    fs::remove(folder / "smile.obj");
    fs::remove(folder / "frown.obj");
    const auto imported = import_from(folder.path());
    ASSERT_FALSE(imported);
    EXPECT_NE(imported.error().message.find(folder.path().string()), std::string::npos);
    EXPECT_NE(imported.error().message.find("no shapes"), std::string::npos);
    EXPECT_FALSE(import_from("no/such/folder"));
}

TEST(ObjImport, TooManyShapesAreRefused) {
    const rig::test::TempFolder folder;
    put_good_folder(folder.path());
    for (std::size_t i = 0; i < kMaxShapes; ++i) put(folder / ("s" + std::to_string(i) + ".obj"), kNeutral);
    const auto imported = import_from(folder.path());
    ASSERT_FALSE(imported);
    EXPECT_NE(imported.error().message.find("at most 256"), std::string::npos);
}

}  // namespace
}  // namespace rig::host
