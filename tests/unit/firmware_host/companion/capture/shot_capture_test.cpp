// A board is waved before two cameras, with drawn pictures: the shots that take themselves lead to the
// cameras that drew them.
#include "firmware_host/companion/capture/shot_capture.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>

#include "firmware_host/companion/calibrate/calibration.hpp"
#include "firmware_host/companion/calibrate/shot_files.hpp"
#include "tests/support/board_scene/board_scene.hpp"
#include "tests/support/random.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/text_checks.hpp"
#include "tests/unit/firmware_host/companion/capture/board_views.hpp"

namespace rig::host {
namespace {

namespace fs = std::filesystem;
using test::has;

constexpr std::size_t kMostPoses = 60;
constexpr std::size_t kStill = 5;  // pictures of a pose at 10 Hz; one of the board on its way before them
constexpr std::size_t kEach = kStill + 1;

// Sensor noise anew for every picture, from a table: drawing is slow.
class NoiseTable {
  public:
    explicit NoiseTable(std::uint64_t seed) : random_(seed) {
        for (double& each : table_) each = random_.normal(0.0, 2.0);
    }
    [[nodiscard]] GreyImage on(const GreyImage& clean) {
        GreyImage out = clean;
        std::size_t at = random_.below(table_.size());
        for (std::uint8_t& pixel : out.pixels) {
            const double dn = std::round(pixel + table_[at]);
            pixel = static_cast<std::uint8_t>(std::clamp(dn, 0.0, 255.0));
            at = at + 1 == table_.size() ? random_.below(997) : at + 1;
        }
        return out;
    }

  private:
    test::SeededRandom random_;
    std::vector<double> table_ = std::vector<double>(65521);
};

// Two cameras, drawn once for all tests of this file.
class WavedBoard : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        board = *parse_board("charuco:9x7:12");
        truth = test::board_rig(LensModel::kRational, 2);
        test::SeededRandom random(41);
        const std::vector<Rigid> poses = enough_of(test::waved_board(board, kMostPoses, 0.7, random));
        test::BoardLook clean;
        clean.noise_dn = 0.0;
        test::BoardLook smeared = clean;
        smeared.smear_px = 3.0;
        NoiseTable noise(5);
        for (std::size_t c = 0; c < 2; ++c) {
            const test::BoardScene scene(board, truth[c]);
            Rigid between = poses[0];
            between.translation_mm += Vec3{15.0, 9.0, 0.0};
            const GreyImage on_its_way = scene.draw(between, smeared, random);
            for (std::size_t p = 0; p < poses.size(); ++p) {
                const GreyImage drawn = scene.draw(poses[p], clean, random);
                for (std::size_t i = 0; i < kEach; ++i) {
                    const auto number = static_cast<std::int64_t>(p * kEach + i + 1);
                    session[c].push_back({100'000 * number, noise.on(i == 0 ? on_its_way : drawn)});
                }
            }
        }
    }
    static void TearDownTestSuite() {
        for (auto& each : session) each.clear();
        truth.clear();
    }

    // So many poses that the plan, told the computed points, is complete: drawing is slow.
    static std::vector<Rigid> enough_of(std::vector<Rigid> poses) {
        CoveragePlan plan(board, 2);
        const std::vector<PictureSize> sizes{{truth[0].width_px, truth[0].height_px},
                                             {truth[1].width_px, truth[1].height_px}};
        for (std::size_t p = 0; p < poses.size(); ++p) {
            std::vector<BoardSighting> views;
            for (const CameraModel& each : truth)
                views.push_back(test::computed_sighting(board, each, poses[p]));
            if (plan.adds(views, sizes)) plan.take(views, sizes);
            if (plan.complete()) poses.resize(std::min(poses.size(), p + 3));
        }
        return poses;
    }

    [[nodiscard]] CaptureTask task() const {
        CaptureTask out;
        out.board = board;
        out.names = {"left", "right"};
        out.folder = folder.path();
        return out;
    }
    [[nodiscard]] static std::vector<std::vector<test::Played>> first_pictures(std::size_t count) {
        std::vector<std::vector<test::Played>> out;
        for (const auto& each : session)
            out.emplace_back(each.begin(),
                             each.begin() + static_cast<std::ptrdiff_t>(std::min(count, each.size())));
        return out;
    }
    [[nodiscard]] std::size_t files_of(const char* camera) const {
        const auto files = pictures_in(folder / camera);
        return files ? files->size() : 0;
    }

    static BoardSpec board;
    static std::vector<CameraModel> truth;
    static std::array<std::vector<test::Played>, 2> session;
    test::TempFolder folder;
};

BoardSpec WavedBoard::board;
std::vector<CameraModel> WavedBoard::truth;
std::array<std::vector<test::Played>, 2> WavedBoard::session;

const CaptureEvents kQuiet{[] { return false; }, [](const CaptureStatus&) {}};

// The cameras that the files of a capture lead to.
Result<Calibration, FileError> calibrated(const BoardSpec& board, const fs::path& folder) {
    const auto list = find_shots({(folder / "left").string(), (folder / "right").string()});
    if (!list) return failure(list.error());
    CalibrationTask task;
    task.camera_names = list->cameras;
    task.board = board;
    for (const Shot& shot : list->shots) {
        const auto image = read_grey_image(shot.file);
        if (!image) return failure(image.error());
        task.pictures.push_back({shot.camera, shot.moment, shot.file.string(), image->width_px,
                                 image->height_px, find_board(image->view(), board)});
    }
    return calibrate(task, [](double) {});
}

TEST_F(WavedBoard, ShotsTakeThemselvesAndLeadToTheCameras) {
    LiveCameras cameras = test::played_cameras(first_pictures(session[0].size()));
    ShotCapture capture(task());
    std::size_t took = 0;
    const CaptureEvents events{[] { return false; },
                               [&](const CaptureStatus& status) {
                                   if (!status.took) return;
                                   ++took;
                                   // 0.3 s of rest are four pictures at 10 Hz; the first is of the way there.
                                   EXPECT_GE((status.moments - 1) % kEach, 4U) << "moment " << status.moments;
                               }};
    const auto end = capture.run(cameras, events);
    ASSERT_TRUE(end.has_value()) << end.error().message;
    EXPECT_EQ(end->shots, took);
    EXPECT_EQ(end->kind, CaptureEndKind::kComplete) << capture.plan().advice(task().names);
    EXPECT_LE(end->shots, session[0].size() / kEach);
    const auto found = calibrated(board, folder.path());
    ASSERT_TRUE(found.has_value()) << found.error().message;
    double focal = 0.0;
    for (std::size_t c = 0; c < 2; ++c) {
        focal = std::max({focal, std::abs(found->cameras[c].fx_px / truth[c].fx_px - 1.0),
                          std::abs(found->cameras[c].fy_px / truth[c].fy_px - 1.0)});
    }
    const double apart_mm = (truth[1].centre_mm - truth[0].centre_mm).norm();
    const double baseline_mm = (found->cameras[1].centre_mm - found->cameras[0].centre_mm).norm() - apart_mm;
    std::printf("%zu shots of %zu poses: focal length within %.4f %%, baseline %.4f mm, rms %.4f px\n", took,
                session[0].size() / kEach, 100.0 * focal, baseline_mm, found->all_rms_px);
    EXPECT_LE(focal, 0.001);
    EXPECT_LE(std::abs(baseline_mm), 0.05);
    for (const PictureVerdict& verdict : found->verdicts) EXPECT_EQ(verdict.rejection, "");
}

TEST_F(WavedBoard, ACameraThatGoesAwayKeepsTheShotsAndTheSessionGoesOn) {
    auto pictures = first_pictures(kEach * 8);
    pictures[1].resize(kEach * 4);
    std::vector<std::unique_ptr<PictureStream>> streams;
    streams.push_back(std::make_unique<test::PlayedStream>(pictures[0], StreamEnd::kEnded));
    streams.push_back(std::make_unique<test::PlayedStream>(pictures[1], StreamEnd::kGone));
    LiveCameras cameras(std::move(streams));
    ShotCapture capture(task());
    const auto end = capture.run(cameras, kQuiet);
    ASSERT_TRUE(end.has_value());
    EXPECT_EQ(end->kind, CaptureEndKind::kGone);
    EXPECT_EQ(end->camera, 1U);
    EXPECT_EQ(end->fault, "unplugged");
    EXPECT_EQ(end->shots, 4U);
    EXPECT_EQ(files_of("left"), 4U);
    EXPECT_EQ(files_of("right"), 4U);

    ShotCapture more(task());
    const auto resumed = more.resume_shots();
    ASSERT_TRUE(resumed.has_value()) << resumed.error().message;
    EXPECT_EQ(*resumed, 4U);
    EXPECT_EQ(more.plan().camera(1).pictures, capture.plan().camera(1).pictures);
    EXPECT_EQ(more.plan().camera(1).seen, capture.plan().camera(1).seen);
    LiveCameras again = test::played_cameras(first_pictures(kEach * 6));
    ASSERT_TRUE(more.run(again, kQuiet).has_value());
    EXPECT_EQ(files_of("left"), 6U) << "the four views of before add nothing again";
}

TEST_F(WavedBoard, StopEndsItAndABoardThatIsNeverStillGivesNoShot) {
    LiveCameras cameras = test::played_cameras(first_pictures(kEach * 3));
    ShotCapture capture(task());
    int asked = 0;
    const CaptureEvents two{[&asked] { return ++asked > 2; }, [](const CaptureStatus&) {}};
    const auto stopped = capture.run(cameras, two);
    ASSERT_TRUE(stopped.has_value());
    EXPECT_EQ(stopped->kind, CaptureEndKind::kStopped);

    std::vector<std::vector<test::Played>> moving(2);
    for (std::size_t c = 0; c < 2; ++c)
        for (std::size_t i = 0; i < 6; ++i) moving[c].push_back(session[c][i * kEach + 3]);
    LiveCameras restless = test::played_cameras(std::move(moving));
    ShotCapture none(task());
    const auto end = none.run(restless, kQuiet);
    ASSERT_TRUE(end.has_value());
    EXPECT_EQ(end->kind, CaptureEndKind::kEnded);
    EXPECT_EQ(end->shots, 0U);
    EXPECT_EQ(end->seen, (std::vector<std::size_t>{6, 6}));
    EXPECT_EQ(files_of("left"), 0U);
}

TEST_F(WavedBoard, TheCommonestReasonIsToldWhenTheBoardIsNeverSeen) {
    CaptureTask other = task();
    other.board = *parse_board("charuco:9x7:12:8:4x4_50");
    LiveCameras cameras = test::played_cameras(first_pictures(4));
    ShotCapture capture(other);
    const auto end = capture.run(cameras, kQuiet);
    ASSERT_TRUE(end.has_value());
    EXPECT_EQ(end->shots, 0U);
    EXPECT_EQ(end->seen, (std::vector<std::size_t>{0, 0}));
    EXPECT_FALSE(end->commonest[0].empty());
}

TEST_F(WavedBoard, AFolderThatCannotBeWrittenIsAnError) {
    CaptureTask bad = task();
    bad.folder = "/dev/null/shots";
    LiveCameras cameras = test::played_cameras(first_pictures(kEach));
    ShotCapture capture(bad);
    const auto end = capture.run(cameras, kQuiet);
    ASSERT_FALSE(end.has_value());
    EXPECT_TRUE(has(end.error().message, "/dev/null/shots")) << end.error().message;
}

}  // namespace
}  // namespace rig::host
