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

TEST_F(BoardFileTest, CamerasOfTheKernelAreDescribed) {
    const auto board = load(
        "name = 'x'\n[[camera]]\nname = 'left'\nsource = 'v4l2:usb-1-2.1'\nserial = 'A17'\nwidth_px = 1280\n"
        "height_px = 800\npixels = 'MJPEG'\ngain_unit_db = 0.5\nreadout_us = 900\n"
        "controls = { \"0x009a0901\" = 1, \"9963795\" = -2 }\n"
        "[[camera]]\nname = 'right'\nsource = 'v4l2:'\n");
    ASSERT_TRUE(board.has_value()) << board.error().message;
    const BoardVideo& video = board->cameras.at(0).video;
    EXPECT_EQ(video.serial, "A17");
    EXPECT_EQ(video.width_px, 1280);
    EXPECT_EQ(video.height_px, 800);
    EXPECT_EQ(video.pixels, "MJPEG");
    EXPECT_EQ(video.gain_unit_db, 0.5);
    EXPECT_EQ(video.readout_us, 900);
    const std::vector<std::pair<std::uint32_t, std::int32_t>> controls{{0x009a0901, 1}, {9963795, -2}};
    EXPECT_EQ(video.controls, controls);
    EXPECT_EQ(board->cameras.at(1).video.width_px, 640);
    EXPECT_EQ(board->cameras.at(1).video.pixels, "auto");
}

TEST_F(BoardFileTest, MistakesNameTheFileAndTheFault) {
    const std::vector<std::pair<const char*, const char*>> mistakes{
        {"name = ", "line 1"},
        {"rate_hz = 60", "'name'"},
        {"name = 7", "line 1: 'name'"},
        {"name = 'x'\nrate_hz = 0.5", "line 2: 'rate_hz'"},
        {"name = 'x'\nrate_hz = nan", "line 2: 'rate_hz'"},
        {"name = 'x'\nrate_hz = 'fast'", "line 2: 'rate_hz'"},
        {"name = 'x'\nfrozen_frames = 1", "line 2: 'frozen_frames'"},
        {"name = 'x'\nfrozen_frames = -3", "line 2: 'frozen_frames'"},
        {"name = 'x'\nfrozen_frames = 2.5", "line 2: 'frozen_frames'"},
        {"name = 'x'\nwatchdog_ms = 5", "line 2: there is no key 'watchdog_ms'"},
        {"name = 'x'\ncolour = 'red'", "'colour'"},
        {"name = 'x'\nsmoothing = 3", "line 2: 'smoothing'"},
        {"name = 'x'\n[smoothing]\nfilter = 'median'", "line 2: [smoothing]: 'filter'"},
        {"name = 'x'\ncamera = 3", "line 2: 'camera' must be a list of tables, [[camera]]"},
        {"name = 'x'\ncamera = [3]", "[[camera]]"},
        {"name = 'x'\n[[camera]]\nname = 'a'", "line 2: [[camera]] 'a': needs a name and a source"},
        {"name = 'x'\n[[camera]]\nname = 'a'\nsource = 'b'\nlens = 3",
         "line 5: [[camera]] 'a': there is no key 'lens'"},
        {"name = 'x'\n[[camera]]\nname = 'a'\nsource = 'world:0'\nwidth_px = 640", "'width_px'"},
        {"name = 'x'\n[[camera]]\nname = 'a'\nsource = 'v4l2:'\nwidth_px = 5",
         "line 5: [[camera]] 'a': 'width_px'"},
        {"name = 'x'\n[[camera]]\nname = 'a'\nsource = 'v4l2:'\npixels = 'RGB'",
         "line 5: [[camera]] 'a': 'pixels'"},
        {"name = 'x'\n[[camera]]\nname = 'a'\nsource = 'v4l2:'\ncontrols = 3", "'controls' must be a table"},
        {"name = 'x'\n[[camera]]\nname = 'a'\nsource = 'v4l2:'\ncontrols = { gain = 3 }", "control 'gain'"},
        {"name = 'x'\n[[camera]]\nname = 'a'\nsource = 'v4l2:'\ncontrols = { \"0x1\" = 5000000000 }",
         "control '0x1'"},
        {"name = 'x'\n[[line]]\nname = 'a'\nsource = 'b'\n[[line]]\nname = 'a'\nsource = 'c'",
         "line 5: [[line]] 'a': two [[line]] have this name"},
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
