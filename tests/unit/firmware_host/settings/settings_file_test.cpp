#include "firmware_host/settings/settings_file.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temp_folder.hpp"

namespace rig {
namespace {

class SettingsFileTest : public testing::Test {
  protected:
    Result<SettingsFile, std::string> read(std::string_view text) {
        const auto path = folder_ / "artist.toml";
        std::ofstream(path) << text;
        return read_settings_file(path);
    }
    test::TempFolder folder_;
};

TEST_F(SettingsFileTest, ControlsKeepTheOrderOfTheFile) {
    const auto file = read(
        "[smoothing]\nfilter = 'savitzky-golay'\n"
        "[controls.mouth]\nsparsity = 2\nrange = [0, 0.8]\n"
        "[controls.all]\nridge = 0.5\n"
        "[controls.'jawLeft,jawRight']\ncancel = true\n"
        "[controls.brows]\nmultiplier = -1.25\n");
    ASSERT_TRUE(file.has_value()) << file.error();
    EXPECT_EQ(file->smoothing.kind, FilterKind::kSavitzkyGolay);
    EXPECT_EQ(file->controls,
              (std::vector<std::string>{"mouth.sparsity=2", "mouth.range=0,0.8", "all.ridge=0.5",
                                        "jawLeft,jawRight.cancel=1", "brows.multiplier=-1.25"}));
}

TEST_F(SettingsFileTest, SmoothingOfShapesKeepsItToo) {
    const auto file = read("[smoothing.shapes]\nmouth = 'none'\nall = 'one-euro'\n");
    ASSERT_TRUE(file.has_value()) << file.error();
    ASSERT_EQ(file->smoothing.shapes.size(), 2U);
    EXPECT_EQ(file->smoothing.shapes[0].first, "mouth");
}

TEST_F(SettingsFileTest, RefusesWithTheFile) {
    for (const char* wrong : {"x", "colour = 1", "[controls]\nbrows = 2", "[controls.brows]\nridge = 'much'",
                              "[controls.brows]\nrange = [1]", "[controls.brows]\nrange = ['a', 'b']",
                              "[smoothing]\nfilter = 3"}) {
        const auto file = read(wrong);
        ASSERT_FALSE(file.has_value()) << wrong;
        EXPECT_NE(file.error().find("artist.toml"), std::string::npos) << file.error();
    }
    EXPECT_FALSE(read_settings_file(folder_ / "nosuch.toml").has_value());
}

}  // namespace
}  // namespace rig
