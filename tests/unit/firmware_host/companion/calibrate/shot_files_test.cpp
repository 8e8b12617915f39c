#include "firmware_host/companion/calibrate/shot_files.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/temp_folder.hpp"

namespace rig::host {
namespace {

namespace fs = std::filesystem;

class ShotFiles : public testing::Test {
  protected:
    void touch(const std::string& name) {
        fs::create_directories((folder.path() / name).parent_path());
        std::ofstream(folder.path() / name) << "x";
    }
    [[nodiscard]] std::string at(const std::string& name) const { return (folder.path() / name).string(); }
    test::TempFolder folder;
};

void expect_fault(const Result<ShotList, FileError>& list, const std::string& part) {
    ASSERT_FALSE(list.has_value());
    EXPECT_NE(list.error().message.find(part), std::string::npos) << list.error().message;
}

TEST_F(ShotFiles, OneFolderACameraAndEqualNamesAreOneMoment) {
    for (const char* name : {"left/1.png", "left/3.png", "left/notes.txt", "right/1.jpg", "right/2.PNG"})
        touch(name);
    const auto list = find_shots({at("left"), at("right") + "/"});
    ASSERT_TRUE(list.has_value()) << list.error().message;
    EXPECT_EQ(list->cameras, (std::vector<std::string>{"left", "right"}));
    ASSERT_EQ(list->shots.size(), 4U);
    EXPECT_EQ(list->shots[0].moment, list->shots[2].moment) << "1.png and 1.jpg";
    EXPECT_NE(list->shots[1].moment, list->shots[3].moment) << "3.png and 2.PNG";
    EXPECT_EQ(list->shots[2].camera, 1U);
}

TEST_F(ShotFiles, PatternsAreNamedByWhatStandsAroundTheStar) {
    for (const char* name : {"left_1.png", "left_2.png", "right_2.png", "rightmost.txt"}) touch(name);
    const auto list = find_shots({at("left_*.png"), at("right_*.png")});
    ASSERT_TRUE(list.has_value()) << list.error().message;
    EXPECT_EQ(list->cameras, (std::vector<std::string>{"left", "right"}));
    ASSERT_EQ(list->shots.size(), 3U);
    EXPECT_EQ(list->shots[1].moment, list->shots[2].moment);
}

TEST_F(ShotFiles, ByNameSplitsAtTheLastMark) {
    for (const char* name : {"f_001_b.pgm", "f_001_a.pgm", "f_002_a.pgm"}) touch(name);
    const auto list = find_shots_by_name(folder.path());
    ASSERT_TRUE(list.has_value()) << list.error().message;
    EXPECT_EQ(list->cameras, (std::vector<std::string>{"a", "b"}));
    EXPECT_EQ(list->shots[0].moment, list->shots[2].moment);
    touch("odd.png");
    expect_fault(find_shots_by_name(folder.path()), "odd.png: is not named MOMENT_CAMERA");
}

TEST_F(ShotFiles, FaultsNameTheArgument) {
    fs::create_directories(folder.path() / "empty");
    touch("a/1.png");
    touch("b/a/1.png");
    touch("twice/1.png");
    touch("twice/1.jpg");
    expect_fault(find_shots({at("empty")}), "empty: has no .png");
    expect_fault(find_shots({at("none")}), "none: is neither a folder nor a pattern");
    expect_fault(find_shots({at("none_*.png")}), "none_*.png: no picture's name matches");
    expect_fault(find_shots({at("gone/x_*.png")}), "cannot be opened");
    expect_fault(find_shots({at("a"), at("b/a")}), "two cameras are called a");
    expect_fault(find_shots({at("twice")}), "the same name as");
    expect_fault(find_shots({at("a"), at("a"), at("a"), at("a"), at("a")}), "5 cameras");
    expect_fault(find_shots_by_name(at("empty")), "empty: has no");
    expect_fault(find_shots_by_name(at("none")), "cannot be opened");
}

}  // namespace
}  // namespace rig::host
