#include "firmware_host/companion/fit/fit_files.hpp"

#include <gtest/gtest.h>

#include "firmware_host/companion/files/whole_file.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/firmware_host/companion/fit/fit_scene.hpp"

namespace rig::host {
namespace {

TEST(FitFiles, WriteAFolderToTrainFrom) {
    test::FitSceneOptions scene_options;
    scene_options.take_from_face.scale = 1.1;
    const test::FitScene scene = test::fit_scene(scene_options);
    FitOptions options;
    options.neutral_end = 20;
    options.stabilised = false;
    const auto fit = fit_layout(scene.tiny.rig, scene.rough, scene.take, options);
    ASSERT_TRUE(fit) << fit.error().message;
    const test::TempFolder folder;
    const auto saved = save_fit(folder.path(), scene.tiny.rig, *fit, true);
    ASSERT_TRUE(saved) << saved.error().message;
    const auto rig = load_rig(folder.path());
    ASSERT_TRUE(rig) << rig.error().message;
    const auto layout = load_layout(folder.path(), "30", *rig);
    ASSERT_TRUE(layout) << layout.error().message;
    for (std::size_t k = 0; k < 30; ++k) {
        EXPECT_EQ(layout->markers[k].vertices, fit->layout.markers[k].vertices);
        for (std::size_t a = 0; a < 3; ++a)
            EXPECT_NEAR(layout->markers[k].offset_mm[a], fit->layout.markers[k].offset_mm[a], 1e-4F);
    }
    const auto rounds = read_whole_text(folder / "fit_rounds.csv");
    ASSERT_TRUE(rounds);
    EXPECT_EQ(std::ranges::count(*rounds, '\n'), static_cast<std::ptrdiff_t>(fit->rounds.size() + 1));
    const auto markers = read_whole_text(folder / "fit_markers.csv");
    ASSERT_TRUE(markers);
    EXPECT_EQ(std::ranges::count(*markers, '\n'), 31);
}

TEST(FitFiles, LeaveTheRigAloneWhenItKeepsItsScale) {
    const test::FitScene scene = test::fit_scene({});
    FitOptions options;
    options.neutral_end = 20;
    options.scaled = false;
    options.stabilised = false;
    const auto fit = fit_layout(scene.tiny.rig, scene.rough, scene.take, options);
    ASSERT_TRUE(fit) << fit.error().message;
    const test::TempFolder folder;
    ASSERT_TRUE(save_fit(folder.path(), scene.tiny.rig, *fit, false));
    EXPECT_FALSE(std::filesystem::exists(folder / "vertices.npy"));
    EXPECT_TRUE(load_layout(".", (folder / "markers_30.csv").string(), scene.tiny.rig));
}

}  // namespace
}  // namespace rig::host
