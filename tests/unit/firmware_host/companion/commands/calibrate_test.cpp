// The verb as a script meets it: pictures on disk in, cameras.json and coverage pictures out, errors by file.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "firmware_host/companion/commands/calibrate_reference.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/files/image_file.hpp"
#include "firmware_host/companion/train/camera_file.hpp"
#include "firmware_host/companion/train/pack_writer.hpp"
#include "tests/support/board_scene/board_scene.hpp"
#include "tests/support/pack_samples/sample_pack.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/text_checks.hpp"
#include "tests/unit/firmware_host/companion/commands/verb_run.hpp"

namespace {

using rig::test::has;

using namespace rig;
namespace fs = std::filesystem;

constexpr const char* kBoard = "charuco:9x7:12";

test::VerbOutcome run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"calibrate", "cameras"});
    return test::run_verb(host::add_calibrate_verb, std::move(arguments));
}

// Two cameras, eight moments, drawn once for all tests of this file.
class CalibrateVerb : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        shared = new test::TempFolder;
        truth = new std::vector<CameraModel>(test::board_rig(LensModel::kRational, 2));
        const host::BoardSpec board = *host::parse_board(kBoard);
        test::SeededRandom random(77);
        const std::vector<Rigid> poses = test::waved_board(board, 8, 0.6, random);
        for (std::size_t c = 0; c < 2; ++c) {
            const fs::path folder = shared->path() / (c == 0 ? "left" : "right");
            fs::create_directories(folder);
            const test::BoardScene scene(board, (*truth)[c]);
            for (std::size_t v = 0; v < poses.size(); ++v) {
                const host::GreyImage image = scene.draw(poses[v], {}, random);
                const auto written =
                    host::write_grey_image(folder / (std::to_string(v) + ".png"), image.view());
                ASSERT_TRUE(written.has_value());
            }
        }
    }
    static void TearDownTestSuite() {
        delete shared;
        delete truth;
    }

    // A copy that a test may spoil.
    void copy_shots() {
        for (const char* name : {"left", "right"})
            fs::copy(shared->path() / name, folder.path() / name, fs::copy_options::recursive);
    }
    [[nodiscard]] std::string at(const std::string& name) const { return (folder.path() / name).string(); }
    [[nodiscard]] std::vector<std::string> arguments() const {
        return {"--board", kBoard, "--images", at("left"), at("right"), "--out", at("cameras.json")};
    }

    static test::TempFolder* shared;
    static std::vector<CameraModel>* truth;
    test::TempFolder folder;
};

test::TempFolder* CalibrateVerb::shared = nullptr;
std::vector<CameraModel>* CalibrateVerb::truth = nullptr;

TEST_F(CalibrateVerb, WritesCamerasThatOtherVerbsReadAndAPictureOfEach) {
    copy_shots();
    std::vector<std::string> all = arguments();
    for (const char* more : {"--row-time-us", "18.5"}) all.emplace_back(more);
    const test::VerbOutcome outcome = run(all);
    ASSERT_EQ(outcome.exit_code, host::kExitOk) << outcome.err;
    const auto cameras = host::load_cameras(at("cameras.json"));
    ASSERT_TRUE(cameras.has_value()) << cameras.error().message;
    ASSERT_EQ(cameras->size(), 2U);
    EXPECT_NEAR(((*cameras)[1].centre_mm - (*cameras)[0].centre_mm).norm(), 90.0, 0.05);
    for (std::size_t c = 0; c < 2; ++c) {
        EXPECT_NEAR((*cameras)[c].fx_px / (*truth)[c].fx_px, 1.0, 1e-3);
        EXPECT_EQ((*cameras)[c].row_time_us, 18.5);
        EXPECT_NE((*cameras)[c].k4, 0.0);
    }
    EXPECT_TRUE(has(outcome.out, "baseline left to right: 90.0")) << outcome.out;
    EXPECT_TRUE(has(outcome.err, "warning: camera left: 8 pictures")) << outcome.err;
    const auto picture = host::read_grey_image(at("cameras_coverage_right.png"));
    ASSERT_TRUE(picture.has_value()) << picture.error().message;
    EXPECT_EQ(picture->width_px, 960);
}

TEST_F(CalibrateVerb, AReferencePutsTheRigWhereTheHelmetHasIt) {
    copy_shots();
    const std::vector<host::CameraEntry> entries{{"left", (*truth)[0]}, {"right", (*truth)[1]}};
    ASSERT_TRUE(host::save_cameras(at("helmet.json"), entries, "construction").has_value());
    std::vector<std::string> all = arguments();
    for (const std::string& more : {std::string("--reference"), at("helmet.json")}) all.push_back(more);
    const test::VerbOutcome outcome = run(all);
    ASSERT_EQ(outcome.exit_code, host::kExitOk) << outcome.err;
    const auto cameras = host::load_cameras(at("cameras.json"));
    ASSERT_TRUE(cameras.has_value());
    for (std::size_t c = 0; c < 2; ++c)
        EXPECT_LT(((*cameras)[c].centre_mm - (*truth)[c].centre_mm).norm(), 0.1);
    ASSERT_TRUE(host::save_cameras(at("helmet.json"), std::span(entries).first(1), "one").has_value());
    const test::VerbOutcome refused = run(all);
    EXPECT_EQ(refused.exit_code, host::kExitInput);
    EXPECT_TRUE(has(refused.err, "has 1 cameras and there are pictures of 2")) << refused.err;
}

TEST_F(CalibrateVerb, TheHelmetsMarksAreCarriedOverAndNeverLostInSilence) {
    copy_shots();
    const std::vector<host::CameraEntry> entries{{"left", (*truth)[0]}, {"right", (*truth)[1]}};
    const std::vector<HelmetMark> marks{{Vec3{-70.0, 66.0, 12.5}, 3}, {Vec3{70.0, 66.0, 12.0}, 2}};
    ASSERT_TRUE(host::save_cameras(at("cameras.json"), entries, "the rig as it was", marks).has_value());
    const test::VerbOutcome refused = run(arguments());
    EXPECT_EQ(refused.exit_code, host::kExitUsage);
    EXPECT_TRUE(has(refused.err, "holds 2 reference marks") && has(refused.err, "--reference"))
        << refused.err;
    ASSERT_EQ(host::load_reference_marks(at("cameras.json"))->size(), 2U) << "the file is as it was";

    std::vector<std::string> all = arguments();
    for (const std::string& more : {std::string("--reference"), at("cameras.json")}) all.push_back(more);
    const test::VerbOutcome outcome = run(all);
    ASSERT_EQ(outcome.exit_code, host::kExitOk) << outcome.err;
    EXPECT_TRUE(has(outcome.out, "reference marks of the helmet: 2 carried over")) << outcome.out;
    const auto kept = host::load_reference_marks(at("cameras.json"));
    ASSERT_TRUE(kept.has_value()) << kept.error().message;
    ASSERT_EQ(kept->size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_EQ((*kept)[i].headset_mm, marks[i].headset_mm);
        EXPECT_EQ((*kept)[i].cameras, marks[i].cameras);
    }
}

TEST_F(CalibrateVerb, TheRigAsItWasIsReadOffAPackToo) {
    const test::SamplePack sample({.cameras = 2, .reference_marks = 3});
    ASSERT_TRUE(host::save_pack(at("face.pack"), sample.view, {}).has_value());
    const auto reference = host::load_rig_reference(at("face.pack"));
    ASSERT_TRUE(reference.has_value()) << reference.error().message;
    ASSERT_EQ(reference->cameras.size(), 2U);
    EXPECT_EQ(reference->cameras[1].centre_mm, sample.view.cameras[1].centre_mm);
    ASSERT_EQ(reference->marks.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(reference->marks[i].headset_mm, sample.view.reference_marks[i].headset_mm);
        EXPECT_EQ(reference->marks[i].cameras, sample.view.reference_marks[i].cameras);
    }
    const test::SamplePack without({.cameras = 0});
    ASSERT_TRUE(host::save_pack(at("blind.pack"), without.view, {}).has_value());
    const auto none = host::load_rig_reference(at("blind.pack"));
    ASSERT_FALSE(none.has_value());
    EXPECT_TRUE(has(none.error().message, "without cameras")) << none.error().message;
    EXPECT_FALSE(host::load_rig_reference(at("missing.json")).has_value());
}

// The eight moments as cameras would deliver them: each held for half a second.
class LiveCalibrateVerb : public CalibrateVerb {
  protected:
    void play(const std::string& camera, std::size_t moments) {
        fs::create_directories(folder.path() / ("live_" + camera));
        for (std::size_t v = 0; v < moments; ++v) {
            for (std::size_t i = 0; i < 5; ++i) {
                fs::create_hard_link(
                    shared->path() / camera / (std::to_string(v) + ".png"),
                    folder.path() / ("live_" + camera) / (std::to_string(1000 + 5 * v + i) + ".png"));
            }
        }
    }
    [[nodiscard]] std::vector<std::string> live() const {
        return {"--board", kBoard,
                "--live",  "left=" + at("live_left") + ",right=" + at("live_right"),
                "--out",   at("cameras.json")};
    }
};

TEST_F(LiveCalibrateVerb, TakesShotsAndCalibratesAsFromTheirFiles) {
    for (const char* camera : {"left", "right"}) play(camera, 8);
    const test::VerbOutcome outcome = run(live());
    ASSERT_EQ(outcome.exit_code, host::kExitOk) << outcome.err;
    EXPECT_TRUE(has(outcome.out, "8 shots are kept in ")) << outcome.out;
    EXPECT_TRUE(has(outcome.err, "shot 8: left 8/18 pictures")) << outcome.err;
    const auto cameras = host::load_cameras(at("cameras.json"));
    ASSERT_TRUE(cameras.has_value()) << cameras.error().message;
    EXPECT_NEAR(((*cameras)[1].centre_mm - (*cameras)[0].centre_mm).norm(), 90.0, 0.05);

    const test::VerbOutcome again = run(live());
    EXPECT_EQ(again.exit_code, host::kExitUsage);
    EXPECT_TRUE(has(again.err, "--continue")) << again.err;
    const test::VerbOutcome from_files = run({"--board", kBoard, "--images", at("cameras_shots/left"),
                                              at("cameras_shots/right"), "--out", at("again.json")});
    ASSERT_EQ(from_files.exit_code, host::kExitOk) << from_files.err;
    const auto repeated = host::load_cameras(at("again.json"));
    ASSERT_TRUE(repeated.has_value());
    for (std::size_t c = 0; c < 2; ++c) {
        EXPECT_EQ((*repeated)[c].fx_px, (*cameras)[c].fx_px);
        EXPECT_EQ((*repeated)[c].centre_mm, (*cameras)[c].centre_mm);
    }
}

TEST_F(LiveCalibrateVerb, ACameraThatGoesAwayKeepsTheShotsAndContinueGoesOn) {
    for (const char* camera : {"left", "right"}) play(camera, 6);
    const fs::path broken = folder.path() / "live_right" / "1010.png";  // of the third moment
    fs::remove(broken);
    std::ofstream(broken) << "no picture";
    const test::VerbOutcome outcome = run(live());
    EXPECT_EQ(outcome.exit_code, host::kExitInput);
    EXPECT_TRUE(has(outcome.err, "camera right went away") && has(outcome.err, "2 shots are kept") &&
                has(outcome.err, "--continue"))
        << outcome.err;
    EXPECT_TRUE(fs::exists(at("cameras_shots/right/0002.png")));
    EXPECT_FALSE(fs::exists(at("cameras.json")));
    fs::remove(broken);
    std::vector<std::string> all = live();
    all.emplace_back("--continue");
    const test::VerbOutcome more = run(all);
    EXPECT_EQ(more.exit_code, host::kExitOk) << more.err;
    EXPECT_TRUE(has(more.out, "2 shots in ") && has(more.out, "6 shots are kept")) << more.out;
    EXPECT_FALSE(fs::exists(at("cameras_shots/right/0007.png")));
}

TEST_F(LiveCalibrateVerb, WhatIsNotThereOrNeverSeenIsSaidWithTheRemedy) {
    const auto with = [&](const std::string& sources) {
        return run({"--board", kBoard, "--live", sources, "--out", at("cameras.json")});
    };
    const test::VerbOutcome none = with("/dev/video99");
    EXPECT_EQ(none.exit_code, host::kExitInput);
    EXPECT_TRUE(has(none.err, "camera a: /dev/video99: there is no such device")) << none.err;
    EXPECT_EQ(with("x=0,x=1").exit_code, host::kExitUsage);
    EXPECT_EQ(with("a/b=0").exit_code, host::kExitInput);  // a path with a = in it, not a name
    EXPECT_EQ(with("0,1,2,3,4").exit_code, host::kExitUsage);

    play("left", 2);
    fs::create_directories(folder.path() / "live_right");
    const host::GreyImage dark{480, 640, std::vector<std::uint8_t>(480 * 640, 3)};
    for (int i = 1000; i < 1010; ++i) {
        const auto path = folder.path() / "live_right" / (std::to_string(i) + ".png");
        ASSERT_TRUE(host::write_grey_image(path, dark.view()).has_value());
    }
    const test::VerbOutcome blind = run(live());
    EXPECT_EQ(blind.exit_code, host::kExitInput);
    EXPECT_TRUE(has(blind.err, "none of camera right: it never saw the board")) << blind.err;
}

TEST_F(CalibrateVerb, ASpoiledFileIsNamedAndTheRestIsUsed) {
    copy_shots();
    std::ofstream(folder.path() / "left" / "3.png", std::ios::trunc) << "no picture";
    const test::VerbOutcome outcome = run(arguments());
    EXPECT_EQ(outcome.exit_code, host::kExitOk) << outcome.err;
    EXPECT_TRUE(has(outcome.out, "not used: ") && has(outcome.out, "left/3.png")) << outcome.out;
    EXPECT_TRUE(has(outcome.out, "7/8")) << outcome.out;
}

TEST_F(CalibrateVerb, ABlurredPictureIsNamed) {
    copy_shots();
    const host::BoardSpec board = *host::parse_board(kBoard);
    test::SeededRandom random(78);
    const test::BoardScene scene(board, (*truth)[1]);
    test::BoardLook look;
    look.smear_px = 2.5;
    const host::GreyImage image = scene.draw(test::waved_board(board, 1, 0.3, random)[0], look, random);
    ASSERT_TRUE(host::write_grey_image(folder.path() / "right" / "9.png", image.view()).has_value());
    const test::VerbOutcome outcome = run(arguments());
    EXPECT_EQ(outcome.exit_code, host::kExitOk) << outcome.err;
    EXPECT_TRUE(has(outcome.out, "right/9.png: blurred: edges 2")) << outcome.out;
}

TEST_F(CalibrateVerb, TheWrongBoardIsSaidWithItsName) {
    copy_shots();
    for (const char* board : {"charuco:7x5:12", "charuco:9x7:12:8:4x4_50", "circles:4x11:8"}) {
        std::vector<std::string> all = arguments();
        all[1] = board;
        const test::VerbOutcome outcome = run(all);
        EXPECT_EQ(outcome.exit_code, host::kExitInput) << board;
        EXPECT_TRUE(has(outcome.err, std::string("--board ") + board)) << outcome.err;
        EXPECT_FALSE(fs::exists(at("cameras.json")));
    }
}

TEST_F(CalibrateVerb, TwoSizesTooFewAndNoPicturesAreErrors) {
    copy_shots();
    const host::GreyImage small{64, 48, std::vector<std::uint8_t>(64 * 48, 90)};
    ASSERT_TRUE(host::write_grey_image(folder.path() / "left" / "small.png", small.view()).has_value());
    test::VerbOutcome outcome = run(arguments());
    EXPECT_EQ(outcome.exit_code, host::kExitInput);
    EXPECT_TRUE(has(outcome.err, "small.png: is 64 x 48 px")) << outcome.err;
    for (const char* name : {"small.png", "0.png", "1.png", "2.png"})
        fs::remove(folder.path() / "left" / name);
    outcome = run(arguments());
    EXPECT_EQ(outcome.exit_code, host::kExitInput);
    EXPECT_TRUE(has(outcome.err, "camera left: 5 of 5 pictures can be used and 6 are needed")) << outcome.err;
    fs::remove_all(folder.path() / "left");
    outcome = run(arguments());
    EXPECT_EQ(outcome.exit_code, host::kExitInput);
    EXPECT_TRUE(has(outcome.err, at("left"))) << outcome.err;
}

TEST_F(CalibrateVerb, MakesTheBoardAndRefusesWhatIsNone) {
    const test::VerbOutcome made = run({"--board", "circles:4x11:8", "--make-board", at("board.png")});
    EXPECT_EQ(made.exit_code, host::kExitOk) << made.err;
    EXPECT_TRUE(has(made.out, "50.0 mm")) << made.out;
    EXPECT_TRUE(fs::exists(at("board.png")));
    EXPECT_EQ(run({"--board", "chess:4x11:8", "--make-board", at("b.png")}).exit_code, host::kExitUsage);
    EXPECT_EQ(run({"--board", kBoard}).exit_code, host::kExitUsage);
    EXPECT_EQ(run({"--board", kBoard, "--images", at("x"), "--by-name", at("y"), "--out", "c"}).exit_code,
              host::kExitUsage);
    EXPECT_EQ(run({"--board", kBoard, "--make-board", at("no/board.png")}).exit_code, host::kExitOutput);
}

}  // namespace
