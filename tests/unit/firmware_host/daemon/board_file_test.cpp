#include "firmware_host/daemon/board_file.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temp_folder.hpp"

namespace rig::test {
namespace {

class BoardFileTest : public testing::Test {
  protected:
    Result<Board, BoardFileError> load(const std::string& text) {
        const std::string path = folder_ / "board.toml";
        std::ofstream(path) << text;
        return load_board(path, folder_.path());
    }
    TempFolder folder_;
};

TEST_F(BoardFileTest, TheBoardThatShipsIsRead) {
    const auto board = load_board("sim", "boards");
    ASSERT_TRUE(board.has_value()) << board.error().message;
    EXPECT_EQ(board->name, "sim");
    EXPECT_EQ(board->cameras.size(), 4U);
    EXPECT_EQ(board->cameras[1].source, "world:1");
    ASSERT_NE(board->line("button_neutral"), nullptr);
    EXPECT_EQ(board->line("button_neutral")->source, "world:1");
    EXPECT_EQ(board->line("horn"), nullptr);
}

TEST_F(BoardFileTest, DefaultsAreFilledIn) {
    const auto board = load("name = 'x'");
    ASSERT_TRUE(board.has_value());
    EXPECT_EQ(board->rate_hz, 60.0);
    EXPECT_EQ(board->frozen_frames, 3);
    EXPECT_TRUE(board->cameras.empty());
}

TEST_F(BoardFileTest, ABoardMaySayHowToSmooth) {
    const auto board = load("name = 'x'\n[smoothing]\nfilter = 'savitzky-golay'\nwindow = 21\n");
    ASSERT_TRUE(board.has_value());
    EXPECT_EQ(board->smoothing.kind, FilterKind::kSavitzkyGolay);
    EXPECT_EQ(board->smoothing.window_frames, 21);
}

TEST_F(BoardFileTest, MistakesNameTheFileAndTheFault) {
    const std::vector<std::pair<const char*, const char*>> mistakes{
        {"name = ", "line 1"},
        {"rate_hz = 60", "'name'"},
        {"name = 'x'\nrate_hz = 0.5", "'rate_hz'"},
        {"name = 'x'\nrate_hz = nan", "'rate_hz'"},
        {"name = 'x'\nfrozen_frames = 1", "'frozen_frames'"},
        {"name = 'x'\nfrozen_frames = -3", "'frozen_frames'"},
        {"name = 'x'\nwatchdog_ms = 5", "'watchdog_ms'"},
        {"name = 'x'\ncolour = 'red'", "'colour'"},
        {"name = 'x'\nsmoothing = 3", "'smoothing'"},
        {"name = 'x'\n[smoothing]\nfilter = 'median'", "[smoothing]: 'filter'"},
        {"name = 'x'\ncamera = 3", "[[camera]]"},
        {"name = 'x'\n[[camera]]\nname = 'a'", "a source"},
        {"name = 'x'\n[[camera]]\nname = 'a'\nsource = 'b'\nlens = 3", "'lens'"},
        {"name = 'x'\n[[line]]\nname = 'a'\nsource = 'b'\n[[line]]\nname = 'a'\nsource = 'c'",
         "two [[line]]"},
    };
    for (const auto& [text, fault] : mistakes) {
        const auto board = load(text);
        ASSERT_FALSE(board.has_value()) << text;
        EXPECT_NE(board.error().message.find("board.toml"), std::string::npos) << board.error().message;
        EXPECT_NE(board.error().message.find(fault), std::string::npos) << board.error().message;
    }
    std::string five = "name = 'x'\n";
    for (const char* name : {"a", "b", "c", "d", "e"})
        five += std::string("[[camera]]\nsource='s'\nname='") + name + "'\n";
    EXPECT_NE(load(five).error().message.find("at most 4"), std::string::npos);
    EXPECT_FALSE(load_board("nosuch", "boards").has_value());
}

}  // namespace
}  // namespace rig::test
