#include "firmware_host/companion/capture/capture_text.hpp"

#include <gtest/gtest.h>

#include "tests/support/text_checks.hpp"
#include "tests/unit/firmware_host/companion/capture/board_views.hpp"

namespace rig::host {
namespace {

using test::has;

class CaptureText : public testing::Test {
  protected:
    CaptureText() : plan(*parse_board("charuco:9x7:12"), 2) {
        status.plan = &plan;
        status.cameras.resize(2);
        status.cameras[0] = {BoardMotion::kMoving, 40, ""};
        status.cameras[1] = {BoardMotion::kUnseen, 0, "no marker of dictionary 5x5_100 was found"};
        end.seen = {5, 0};
        end.commonest = {"", "too dark"};
    }
    CoveragePlan plan;
    CaptureStatus status;
    CaptureEnd end;
    std::vector<std::string> names{"left", "right"};
};

TEST_F(CaptureText, SaysWhatEachCameraHasAndWhatComesNext) {
    const std::vector<std::string> lines = capture_lines(status, names);
    ASSERT_EQ(lines.size(), 4U);
    EXPECT_TRUE(has(lines[0], "shots 0,") && has(lines[0], "Enter ends")) << lines[0];
    EXPECT_TRUE(has(lines[1], "camera left") && has(lines[1], " 0/18") && has(lines[1], "moving, 40 points"))
        << lines[1];
    EXPECT_TRUE(has(lines[1], "lacks tilt TBLR")) << lines[1];
    EXPECT_TRUE(has(lines[2], "not linked") && has(lines[2], "no marker of dictionary")) << lines[2];
    EXPECT_TRUE(has(lines[3], "next: hold the board before camera ") && has(lines[3], "keep it still"))
        << lines[3];
    EXPECT_TRUE(has(capture_line(status, names), "shot 0: left 0/18 pictures 0 %, right"))
        << capture_line(status, names);
}

TEST_F(CaptureText, TheEndSaysWhatIsKeptAndWhatToDo) {
    end.shots = 0;
    end.kind = CaptureEndKind::kEnded;
    std::string text = capture_end_text(end, names, "out/shots");
    EXPECT_TRUE(has(text, "camera right never saw the board (too dark)") &&
                has(text, "camera left saw it in 5 pictures, never still") && has(text, "--board"))
        << text;
    end.kind = CaptureEndKind::kGone;
    end.camera = 1;
    end.fault = "/dev/video2 gives no more pictures";
    EXPECT_TRUE(has(capture_end_text(end, names, "out/shots"), "camera right went away: /dev/video2"));
    end.shots = 7;
    text = capture_end_text(end, names, "out/shots");
    EXPECT_TRUE(has(text, "7 shots are kept in out/shots") && has(text, "--continue")) << text;
    end.kind = CaptureEndKind::kComplete;
    EXPECT_TRUE(has(capture_end_text(end, names, "out/shots"), "enough of every camera"));
    end.kind = CaptureEndKind::kStopped;
    EXPECT_TRUE(has(capture_end_text(end, names, "out/shots"), "before everything was covered"));
}

}  // namespace
}  // namespace rig::host
