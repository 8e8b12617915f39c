#include "firmware_host/companion/rig_folder/rig_folder.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "core/limits.hpp"
#include "firmware_host/companion/files/whole_file.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/firmware_host/companion/rig_folder/small_rig.hpp"

namespace rig::host {
namespace {

namespace fs = std::filesystem;

TEST(RigFolder, LoadsWhatItSaves) {
    const rig::test::TempFolder folder;
    const Rig rig = rig::test::small_rig();
    ASSERT_TRUE(save_rig(folder.path(), rig));
    const auto back = load_rig(folder.path());
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->vertices_mm, rig.vertices_mm);
    EXPECT_EQ(back->triangles, rig.triangles);
    EXPECT_EQ(back->triangle_part, rig.triangle_part);
    EXPECT_EQ(back->parts, rig.parts);
    ASSERT_EQ(back->shapes.size(), rig.shapes.size());
    for (std::size_t s = 0; s < rig.shapes.size(); ++s) {
        EXPECT_EQ(back->shapes[s].name, rig.shapes[s].name);
        EXPECT_EQ(back->shapes[s].vertices, rig.shapes[s].vertices);
        EXPECT_EQ(back->shapes[s].delta_mm, rig.shapes[s].delta_mm);
    }
}

TEST(RigFolder, AShapeMayMoveNothing) {
    const rig::test::TempFolder folder;
    Rig rig = rig::test::small_rig();
    rig.shapes.insert(rig.shapes.begin(), {.name = "tongueOut", .vertices = {}, .delta_mm = {}});
    ASSERT_TRUE(save_rig(folder.path(), rig));
    const auto back = load_rig(folder.path());
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_TRUE(back->shapes[0].vertices.empty());
    EXPECT_EQ(back->shapes[1].vertices, rig.shapes[1].vertices);
}

TEST(RigFolder, MissingFolderSaysWhatToDo) {
    const auto result = load_rig("no/such/rig");
    ASSERT_FALSE(result);
    EXPECT_NE(result.error().message.find("no/such/rig"), std::string::npos);
    EXPECT_NE(result.error().message.find("headrig sample"), std::string::npos);
}

TEST(MarkerModel, IsTheWeightedSumOfItsVertices) {
    const Rig rig = rig::test::small_rig();
    const MarkerModel model = marker_model(rig, rig::test::small_layout(rig));
    ASSERT_EQ(model.neutral_mm.size(), 15U);
    ASSERT_EQ(model.basis_mm.size(), 30U);
    // E: a half of vertex 0 (0, 0, 0), quarters of 1 (10, 0, 2.5) and 4 (10, 10, 2.5).
    EXPECT_FLOAT_EQ(model.neutral_mm[12], 5.0F);
    EXPECT_FLOAT_EQ(model.neutral_mm[13], 2.5F);
    EXPECT_FLOAT_EQ(model.neutral_mm[14], 1.25F);
    // jawOpen moves vertex 0 by -1 and vertex 1 by (-2, 0.5).
    EXPECT_FLOAT_EQ(model.basis_mm[13 * 2], -1.0F);
    EXPECT_FLOAT_EQ(model.basis_mm[14 * 2], 0.125F);
    EXPECT_FLOAT_EQ(model.basis_mm[13 * 2 + 1], 0.0F);
    // browUp moves C, vertex 8.
    EXPECT_FLOAT_EQ(model.basis_mm[7 * 2 + 1], 3.0F);
}

// One way to spoil a good folder, and what the error must name.
struct Damage {
    std::string label;
    std::string file;
    std::string fault;
    std::function<void(const fs::path&)> spoil;
};

template <class T>
void put(const fs::path& path, std::vector<std::size_t> shape, std::vector<T> values) {
    ASSERT_TRUE(write_npy<T>(path, {.shape = std::move(shape), .values = std::move(values)}));
}

Damage text_damage(std::string label, std::string file, std::string fault, std::string text) {
    return {std::move(label), file, std::move(fault),
            [file, text](const fs::path& folder) { ASSERT_TRUE(write_whole_text(folder / file, text)); }};
}

std::string many_names(std::size_t count) {
    std::string text;
    for (std::size_t i = 0; i < count; ++i) text += "n" + std::to_string(i) + "\n";
    return text;
}

const float kNan = std::numeric_limits<float>::quiet_NaN();

// Each file away, empty, cut, or of another type.
std::vector<Damage> file_damages() {
    std::vector<Damage> list;
    for (const char* file : {"vertices.npy", "triangles.npy", "triangle_part.npy", "parts.txt",
                             "blendshapes.txt", "delta_offsets.npy", "delta_vertex.npy", "delta_xyz.npy"}) {
        std::string stem{file};
        stem = stem.substr(0, stem.find('.'));
        list.push_back({"missing_" + stem, file, "cannot be opened",
                        [file](const fs::path& f) { fs::remove(f / file); }});
        list.push_back(
            {"empty_" + stem, file, "", [file](const fs::path& f) { fs::resize_file(f / file, 0); }});
        if (std::string_view{file}.ends_with(".npy")) {
            list.push_back({"cut_" + stem, file, "cut short", [file](const fs::path& f) {
                                fs::resize_file(f / file, fs::file_size(f / file) - 1);
                            }});
            list.push_back({"type_" + stem, file, "type",
                            [file](const fs::path& f) { put<std::int16_t>(f / file, {1}, {0}); }});
        }
    }
    return list;
}

std::vector<Damage> mesh_damages() {
    std::vector<Damage> list;
    const auto add = [&](std::string label, std::string file, std::string fault, auto spoil) {
        list.push_back({std::move(label), std::move(file), std::move(fault), spoil});
    };
    add("flat_vertices", "vertices.npy", "(n, 3)",
        [](const fs::path& f) { put<float>(f / "vertices.npy", {27}, std::vector<float>(27)); });
    add("no_vertices", "vertices.npy", "no vertices",
        [](const fs::path& f) { put<float>(f / "vertices.npy", {0, 3}, {}); });
    add("nan_vertex", "vertices.npy", "vertex 8", [](const fs::path& f) {
        std::vector<float> values(27, 1.0F);
        values[25] = kNan;
        put<float>(f / "vertices.npy", {9, 3}, values);
    });
    add("far_vertex", "vertices.npy", "vertex 0",
        [](const fs::path& f) { put<float>(f / "vertices.npy", {9, 3}, std::vector<float>(27, 1e9F)); });
    add("no_triangles", "triangles.npy", "no triangles",
        [](const fs::path& f) { put<std::int32_t>(f / "triangles.npy", {0, 3}, {}); });
    add("triangle_range", "triangles.npy", "vertex 9",
        [](const fs::path& f) { put<std::int32_t>(f / "triangles.npy", {1, 3}, {0, 1, 9}); });
    add("triangle_negative", "triangles.npy", "vertex -1",
        [](const fs::path& f) { put<std::int32_t>(f / "triangles.npy", {1, 3}, {0, 1, -1}); });
    add("quads", "triangles.npy", "(n, 3)",
        [](const fs::path& f) { put<std::int32_t>(f / "triangles.npy", {1, 4}, {0, 1, 4, 3}); });
    add("part_count", "triangle_part.npy", "7 entries", [](const fs::path& f) {
        put<std::uint8_t>(f / "triangle_part.npy", {7}, std::vector<std::uint8_t>(7));
    });
    add("part_range", "triangle_part.npy", "part 2", [](const fs::path& f) {
        put<std::uint8_t>(f / "triangle_part.npy", {8}, std::vector<std::uint8_t>(8, 2));
    });
    return list;
}

std::vector<Damage> shape_damages() {
    std::vector<Damage> list;
    const auto add = [&](std::string label, std::string file, std::string fault, auto spoil) {
        list.push_back({std::move(label), std::move(file), std::move(fault), spoil});
    };
    list.push_back(text_damage("part_twice", "parts.txt", "two parts", "face\nface\n"));
    list.push_back(text_damage("shape_twice", "blendshapes.txt", "two shapes are named 'a'", "a\na\n"));
    list.push_back(text_damage("shape_blank", "blendshapes.txt", "cannot be the name", "a\n\n"));
    list.push_back(text_damage("shape_comma", "blendshapes.txt", "cannot be the name", "a\nb,c\n"));
    list.push_back(text_damage("shape_long", "blendshapes.txt", "cannot be the name",
                               "a\n" + std::string(kMaxNameBytes + 1, 'b') + "\n"));
    list.push_back(text_damage("shape_control", "blendshapes.txt", "cannot be the name", "a\nb\x01\n"));
    list.push_back(
        text_damage("shapes_over_limit", "blendshapes.txt", "at most 256", many_names(kMaxShapes + 1)));
    list.push_back({"more_names_than_offsets", "delta_offsets.npy", "expected 4", [](const fs::path& f) {
                        ASSERT_TRUE(write_whole_text(f / "blendshapes.txt", "a\nb\nc\n"));
                    }});
    add("offset_start", "delta_offsets.npy", "not 0",
        [](const fs::path& f) { put<std::int32_t>(f / "delta_offsets.npy", {3}, {1, 3, 5}); });
    add("offset_falls", "delta_offsets.npy", "fall",
        [](const fs::path& f) { put<std::int32_t>(f / "delta_offsets.npy", {3}, {0, 6, 5}); });
    add("offset_end", "delta_offsets.npy", "last offset is 4",
        [](const fs::path& f) { put<std::int32_t>(f / "delta_offsets.npy", {3}, {0, 3, 4}); });
    add("offset_negative", "delta_offsets.npy", "fall",
        [](const fs::path& f) { put<std::int32_t>(f / "delta_offsets.npy", {3}, {0, -3, 5}); });
    add("delta_range", "delta_vertex.npy", "vertex 9",
        [](const fs::path& f) { put<std::int32_t>(f / "delta_vertex.npy", {5}, {0, 1, 9, 8, 6}); });
    add("delta_negative", "delta_vertex.npy", "vertex -1",
        [](const fs::path& f) { put<std::int32_t>(f / "delta_vertex.npy", {5}, {0, 1, 2, -1, 6}); });
    add("delta_twice", "delta_vertex.npy", "twice",
        [](const fs::path& f) { put<std::int32_t>(f / "delta_vertex.npy", {5}, {0, 1, 0, 8, 6}); });
    add("delta_count", "delta_xyz.npy", "4 rows",
        [](const fs::path& f) { put<float>(f / "delta_xyz.npy", {4, 3}, std::vector<float>(12)); });
    add("delta_nan", "delta_xyz.npy", "row 0",
        [](const fs::path& f) { put<float>(f / "delta_xyz.npy", {5, 3}, std::vector<float>(15, kNan)); });
    add("delta_infinite", "delta_xyz.npy", "row 0", [](const fs::path& f) {
        put<float>(f / "delta_xyz.npy", {5, 3}, std::vector<float>(15, HUGE_VALF));
    });
    return list;
}

class MalformedRig : public testing::TestWithParam<Damage> {};

TEST_P(MalformedRig, NamesFileAndFault) {
    const rig::test::TempFolder folder;
    ASSERT_TRUE(save_rig(folder.path(), rig::test::small_rig()));
    ASSERT_TRUE(load_rig(folder.path()));
    GetParam().spoil(folder.path());
    const auto result = load_rig(folder.path());
    ASSERT_FALSE(result);
    EXPECT_NE(result.error().message.find(GetParam().file), std::string::npos) << result.error().message;
    EXPECT_NE(result.error().message.find(GetParam().fault), std::string::npos) << result.error().message;
}

INSTANTIATE_TEST_SUITE_P(Files, MalformedRig, testing::ValuesIn(file_damages()),
                         [](const auto& row) { return row.param.label; });
INSTANTIATE_TEST_SUITE_P(Mesh, MalformedRig, testing::ValuesIn(mesh_damages()),
                         [](const auto& row) { return row.param.label; });
INSTANTIATE_TEST_SUITE_P(Shapes, MalformedRig, testing::ValuesIn(shape_damages()),
                         [](const auto& row) { return row.param.label; });

}  // namespace
}  // namespace rig::host
