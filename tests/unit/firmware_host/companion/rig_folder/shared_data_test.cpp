// The loader against the real head: the format is that of the shared data, byte for byte.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "firmware_host/companion/rig_folder/rig_folder.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::host {
namespace {

TEST(SharedRig, LoadsWhole) {
    RIG_SHARED_DATA_OR_SKIP(path, "rig");
    const auto rig = load_rig(path);
    ASSERT_TRUE(rig) << rig.error().message;
    EXPECT_EQ(rig->vertices_mm.size(), 24591U);
    EXPECT_EQ(rig->triangles.size(), 48836U);
    EXPECT_EQ(rig->shapes.size(), 53U);
    EXPECT_EQ(rig->parts.front(), "M_Face");
}

using MarkerMotion = std::array<float, 3>;

MarkerMotion motion(const std::vector<float>& basis_mm, std::size_t shape_count, std::size_t marker,
                    std::size_t shape) {
    const std::size_t first = 3 * marker * shape_count + shape;
    return {basis_mm[first], basis_mm[first + shape_count], basis_mm[first + 2 * shape_count]};
}

float length(const MarkerMotion& x) {
    return std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
}

class SharedLayout : public testing::TestWithParam<int> {};

TEST_P(SharedLayout, MarkerModelAgreesWithTheFilesBesideIt) {
    RIG_SHARED_DATA_OR_SKIP(path, "rig");
    const std::string count = std::to_string(GetParam());
    const auto rig = load_rig(path);
    ASSERT_TRUE(rig) << rig.error().message;
    const auto layout = load_layout(path, count, *rig);
    ASSERT_TRUE(layout) << layout.error().message;
    ASSERT_EQ(layout->markers.size(), static_cast<std::size_t>(GetParam()));
    const MarkerModel model = marker_model(*rig, *layout);
    const auto basis = read_npy<float>(path / ("markers_" + count + "_B.npy"));
    const auto neutral = read_npy<float>(path / ("markers_" + count + "_neutral.npy"));
    ASSERT_TRUE(basis && neutral);
    ASSERT_EQ(basis->values.size(), model.basis_mm.size());
    ASSERT_EQ(neutral->values.size(), model.neutral_mm.size());
    float worst_mm = 0.0F;
    for (std::size_t i = 0; i < model.neutral_mm.size(); ++i) {
        worst_mm = std::max(worst_mm, std::abs(model.neutral_mm[i] - neutral->values[i]));
    }
    // The B files were made before deltas under 0.005 mm were dropped from the shapes: where the shapes still
    // hold a delta they agree, elsewhere the B file holds less than what was dropped.
    std::size_t held = 0;
    float worst_dropped_mm = 0.0F;
    for (std::size_t m = 0; m < layout->markers.size(); ++m) {
        for (std::size_t s = 0; s < rig->shapes.size(); ++s) {
            const MarkerMotion ours = motion(model.basis_mm, rig->shapes.size(), m, s);
            const MarkerMotion theirs = motion(basis->values, rig->shapes.size(), m, s);
            if (length(ours) > 0.0F) {
                ++held;
                worst_mm = std::max(worst_mm,
                                    length({ours[0] - theirs[0], ours[1] - theirs[1], ours[2] - theirs[2]}));
            } else {
                worst_dropped_mm = std::max(worst_dropped_mm, length(theirs));
            }
        }
    }
    RecordProperty("worst_difference_mm", std::to_string(worst_mm));
    EXPECT_LE(worst_mm, 1.0e-4F);
    EXPECT_LE(worst_dropped_mm, 0.005F);
    EXPECT_GT(held, layout->markers.size() * rig->shapes.size() / 3);
}

INSTANTIATE_TEST_SUITE_P(Layouts, SharedLayout, testing::Values(50, 60, 102));

TEST(SharedTake, LoadsWithRateAndNames) {
    RIG_SHARED_DATA_OR_SKIP(path, "rig");
    const auto rig = load_rig(path);
    ASSERT_TRUE(rig) << rig.error().message;
    const auto take = load_take(path.parent_path() / "takes/alex_rom_3_weights60.csv", *rig);
    ASSERT_TRUE(take) << take.error().message;
    EXPECT_EQ(take->frame_count, 8063U);
    EXPECT_EQ(take->rate_hz, 60.0);
    EXPECT_FLOAT_EQ(take->weights[2], 0.13901F);
    EXPECT_EQ(take->shape_names.size(), 53U);
}

TEST(SharedRig, SavesToTheSameBytes) {
    RIG_SHARED_DATA_OR_SKIP(path, "rig");
    const auto rig = load_rig(path);
    ASSERT_TRUE(rig) << rig.error().message;
    const rig::test::TempFolder copy;
    ASSERT_TRUE(save_rig(copy.path(), *rig));
    const auto again = load_rig(copy.path());
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_EQ(again->vertices_mm, rig->vertices_mm);
    EXPECT_EQ(again->triangles, rig->triangles);
    EXPECT_EQ(again->triangle_part, rig->triangle_part);
    for (const char* name :
         {"vertices.npy", "triangles.npy", "delta_offsets.npy", "delta_xyz.npy", "blendshapes.txt"}) {
        EXPECT_EQ(std::filesystem::file_size(path / name), std::filesystem::file_size(copy / name)) << name;
    }
}

}  // namespace
}  // namespace rig::host
