// Four cameras calibrated from drawn boards, against the numbers they were drawn with.
#include "firmware_host/companion/calibrate/calibration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "tests/support/board_scene/board_scene.hpp"
#include "tests/support/text_checks.hpp"

namespace rig::host {
namespace {

using test::has;

BoardSpec board_of(const char* text) {
    const auto board = parse_board(text);
    EXPECT_TRUE(board.has_value());
    return *board;
}

struct DrawnRig {
    std::vector<CameraModel> truth;
    CalibrationTask task;
};

DrawnRig drawn_rig(const BoardSpec& board, LensModel lens, LensTerms terms, std::size_t cameras,
                   std::size_t views, std::uint64_t seed) {
    DrawnRig out;
    out.truth = test::board_rig(lens, cameras);
    out.task.board = board;
    out.task.terms = terms;
    test::SeededRandom random(seed);
    const std::vector<Rigid> poses = test::waved_board(board, views, 0.7, random);
    for (std::size_t c = 0; c < cameras; ++c) {
        out.task.camera_names.emplace_back(1, static_cast<char>('a' + c));
        const test::BoardScene scene(board, out.truth[c]);
        for (std::size_t v = 0; v < views; ++v) {
            const GreyImage image = scene.draw(poses[v], {}, random);
            CalibrationPicture picture;
            picture.camera = c;
            picture.moment = v;
            picture.file = out.task.camera_names[c] + "/" + std::to_string(v) + ".png";
            picture.width_px = image.width_px;
            picture.height_px = image.height_px;
            picture.sighting = find_board(image.view(), board);
            out.task.pictures.push_back(picture);
        }
    }
    return out;
}

struct Errors {
    double focal_share = 0.0;
    double centre_px = 0.0;
    double baseline_mm = 0.0;
    double angle_rad = 0.0;
};

Errors errors_of(const DrawnRig& rig, const Calibration& found) {
    Errors out;
    for (std::size_t c = 0; c < rig.truth.size(); ++c) {
        const CameraModel& truth = rig.truth[c];
        const CameraModel& camera = found.cameras[c];
        out.focal_share = std::max({out.focal_share, std::abs(camera.fx_px / truth.fx_px - 1.0),
                                    std::abs(camera.fy_px / truth.fy_px - 1.0)});
        out.centre_px = std::max(
            {out.centre_px, std::abs(camera.cx_px - truth.cx_px), std::abs(camera.cy_px - truth.cy_px)});
        for (std::size_t d = 0; d < c; ++d) {
            const double apart = (truth.centre_mm - rig.truth[d].centre_mm).norm();
            const double seen = (camera.centre_mm - found.cameras[d].centre_mm).norm();
            out.baseline_mm = std::max(out.baseline_mm, std::abs(apart - seen));
        }
    }
    return out;
}

struct RigCase {
    const char* name;
    const char* board;
    LensModel lens;
    LensTerms terms;
};

class DrawnBoards : public testing::TestWithParam<RigCase> {};

TEST_P(DrawnBoards, FourCamerasComeBackWithinTheBounds) {
    const RigCase& each = GetParam();
    const DrawnRig rig = drawn_rig(board_of(each.board), each.lens, each.terms, 4, 25, 41);
    const auto found = calibrate(rig.task, [](double) {});
    ASSERT_TRUE(found.has_value()) << found.error().message;
    const Errors errors = errors_of(rig, *found);
    std::printf(
        "%s: focal length within %.4f %%, centre %.3f px, baselines %.4f mm, rms %.4f px, triangulated %.4f "
        "mm over "
        "%zu points\n",
        each.name, 100.0 * errors.focal_share, errors.centre_px, errors.baseline_mm, found->all_rms_px,
        found->triangulation.rms_mm, found->triangulation.points);
    for (std::size_t c = 0; c < 4; ++c) {
        std::printf(
            "  %s: %zu pictures, %zu points, rms %.4f px, coverage %.2f, f +- %.3f px, baseline +- %.4f mm\n",
            rig.task.camera_names[c].c_str(), found->picture_count[c], found->point_count[c],
            found->rms_px[c], found->coverage[c], found->uncertainty[c].fx_px,
            found->uncertainty[c].baseline_mm);
    }
    for (std::size_t p = 0; p < rig.task.pictures.size(); ++p) {
        if (!found->verdicts[p].rejection.empty())
            std::printf("  %s: %s\n", rig.task.pictures[p].file.c_str(),
                        found->verdicts[p].rejection.c_str());
    }
    EXPECT_TRUE(found->converged);
    EXPECT_LE(errors.focal_share, 0.001);
    EXPECT_LE(errors.baseline_mm, 0.05);
    for (const double rms : found->rms_px) EXPECT_LE(rms, 0.15);
    EXPECT_GT(found->triangulation.points, 500U);
    EXPECT_LE(found->triangulation.rms_mm, 0.05);
}

INSTANTIATE_TEST_SUITE_P(
    Boards, DrawnBoards,
    testing::Values(RigCase{"RationalCharuco", "charuco:9x7:12", LensModel::kRational, LensTerms::kRational},
                    RigCase{"RationalCircles", "circles:4x11:8", LensModel::kRational, LensTerms::kRational},
                    RigCase{"FisheyeCharuco", "charuco:9x7:12", LensModel::kFisheye, LensTerms::kFisheye}),
    [](const auto& each) { return each.param.name; });

// Misuse, on points that are computed instead of drawn.
class ComputedPoints : public testing::Test {
  protected:
    ComputedPoints() {
        truth = test::board_rig(LensModel::kRational, 2);
        task.board = board_of("charuco:9x7:12");
        task.terms = LensTerms::kRational;
        task.camera_names = {"left", "right"};
        test::SeededRandom random(7);
        const std::vector<Rigid> poses = test::waved_board(task.board, 14, 0.6, random);
        for (std::size_t c = 0; c < 2; ++c) {
            for (std::size_t v = 0; v < poses.size(); ++v) {
                CalibrationPicture picture;
                picture.camera = c;
                picture.moment = v;
                picture.file = task.camera_names[c] + "/" + std::to_string(v) + ".png";
                picture.width_px = truth[c].width_px;
                picture.height_px = truth[c].height_px;
                picture.sighting = sighting_of(truth[c], poses[v], random);
                task.pictures.push_back(picture);
            }
        }
    }

    BoardSighting sighting_of(const CameraModel& camera, const Rigid& pose,
                              test::SeededRandom& random) const {
        BoardSighting sighting;
        sighting.edge_sigma_px = 0.7;
        const std::vector<BoardPoint> points = board_points(task.board);
        for (std::size_t i = 0; i < points.size(); ++i) {
            const Projection at = project(camera, pose.apply(Vec3{points[i].x_mm, points[i].y_mm, 0.0}));
            if (!(at.z_mm > 0.0) || at.pixel[0] < 0.0 || at.pixel[1] < 0.0 ||
                at.pixel[0] > camera.width_px - 1.0 || at.pixel[1] > camera.height_px - 1.0) {
                continue;
            }
            sighting.points.push_back(i);
            sighting.x_px.push_back(at.pixel[0] + random.normal(0.0, 0.02));
            sighting.y_px.push_back(at.pixel[1] + random.normal(0.0, 0.02));
        }
        return sighting;
    }

    [[nodiscard]] std::string fault() const {
        const auto found = calibrate(task, [](double) {});
        EXPECT_FALSE(found.has_value());
        return found ? "" : found.error().message;
    }

    std::vector<CameraModel> truth;
    CalibrationTask task;
};

TEST_F(ComputedPoints, AreCalibratedToTheirNoise) {
    const auto found = calibrate(task, [](double) {});
    ASSERT_TRUE(found.has_value()) << found.error().message;
    EXPECT_NEAR(found->all_rms_px, 0.02 * std::sqrt(2.0), 0.003);
    const double baseline = (found->cameras[1].centre_mm - found->cameras[0].centre_mm).norm();
    EXPECT_NEAR(baseline, 90.0, 5.0 * found->uncertainty[1].baseline_mm);
    EXPECT_LT(found->uncertainty[1].baseline_mm, 0.02);
    EXPECT_NEAR(found->cameras[0].fx_px, truth[0].fx_px, 5.0 * found->uncertainty[0].fx_px);
    for (const PictureVerdict& verdict : found->verdicts) EXPECT_EQ(verdict.rejection, "");
}

// Fifty rigs' worth of noise would be slow; ten say that the stated deviations are of the right size.
TEST_F(ComputedPoints, StatedDeviationsAreWhatRepetitionShows) {
    test::SeededRandom random(19);
    double squared = 0.0;
    constexpr int kRuns = 12;
    const CalibrationTask clean = task;
    for (int run = 0; run < kRuns; ++run) {
        task = clean;
        for (CalibrationPicture& picture : task.pictures) {
            for (double& x : picture.sighting.x_px) x += random.normal(0.0, 0.1);
            for (double& y : picture.sighting.y_px) y += random.normal(0.0, 0.1);
        }
        const auto found = calibrate(task, [](double) {});
        ASSERT_TRUE(found.has_value());
        const double off = (found->cameras[0].fx_px - truth[0].fx_px) / found->uncertainty[0].fx_px;
        squared += off * off / kRuns;
    }
    EXPECT_GT(squared, 0.25);
    EXPECT_LT(squared, 2.5);
}

TEST_F(ComputedPoints, ABlurredPictureIsLeftOutWithTheReason) {
    task.pictures[3].sighting.edge_sigma_px = 3.5;
    const auto found = calibrate(task, [](double) {});
    ASSERT_TRUE(found.has_value()) << found.error().message;
    EXPECT_TRUE(has(found->verdicts[3].rejection, "blurred: edges 3.5 px")) << found->verdicts[3].rejection;
    EXPECT_EQ(found->picture_count[0], 13U);
}

TEST_F(ComputedPoints, AnUnreadableFileIsLeftOutWithTheReason) {
    task.pictures[2].width_px = task.pictures[2].height_px = 0;
    task.pictures[2].sighting = BoardSighting{};
    task.pictures[2].sighting.fault = "left/2.png: is cut short";
    const auto found = calibrate(task, [](double) {});
    ASSERT_TRUE(found.has_value()) << found.error().message;
    EXPECT_EQ(found->verdicts[2].rejection, "left/2.png: is cut short");
}

TEST_F(ComputedPoints, AMistakenPointAndAPictureOfAnotherMomentAreLeftOut) {
    task.pictures[1].sighting.x_px[5] += 4.0;
    task.pictures[20].sighting = task.pictures[26].sighting;  // the board elsewhere than camera "left" has it
    const auto found = calibrate(task, [](double) {});
    ASSERT_TRUE(found.has_value()) << found.error().message;
    EXPECT_EQ(found->verdicts[1].outliers, 1U);
    EXPECT_TRUE(has(found->verdicts[20].rejection, "does not fit") ||
                has(found->verdicts[6].rejection, "does not fit"));
    EXPECT_LT(found->all_rms_px, 0.04);
}

TEST_F(ComputedPoints, PicturesOfTwoSizesAreAnErrorThatNamesBoth) {
    task.pictures[4].width_px = 640;
    const std::string message = fault();
    EXPECT_TRUE(has(message, "left/4.png") && has(message, "left/0.png") && has(message, "640 x 640"))
        << message;
}

TEST_F(ComputedPoints, TooFewPicturesAreAnErrorWithTheirNumber) {
    task.pictures.erase(task.pictures.begin() + 5, task.pictures.begin() + 14);
    EXPECT_TRUE(has(fault(), "camera left: 5 of 5 pictures can be used and 6 are needed")) << fault();
    task.pictures.clear();
    EXPECT_TRUE(has(fault(), "0 of 0 pictures")) << fault();
}

TEST_F(ComputedPoints, TheMostFrequentReasonIsInTheError) {
    for (std::size_t p = 14; p < 24; ++p)
        task.pictures[p].sighting.fault = "no marker of dictionary 5x5_100 was found";
    EXPECT_TRUE(has(fault(), "camera right: 4 of 14") && has(fault(), "no marker of dictionary")) << fault();
}

TEST_F(ComputedPoints, AWrongBoardDoesNotFit) {
    task.board = board_of("charuco:12x7:12");  // numbers mean other corners
    const std::string message = fault();
    EXPECT_TRUE(has(message, "--board charuco:12x7:12")) << message;
}

TEST_F(ComputedPoints, CamerasThatNeverSawTheBoardTogetherAreAnError) {
    for (std::size_t p = 14; p < 28; ++p) task.pictures[p].moment += 14;
    EXPECT_TRUE(has(fault(), "camera right: it and any other camera saw the board together in 0 moments"))
        << fault();
}

TEST_F(ComputedPoints, ABoardThatAlwaysFacedTheCameraIsNoCalibration) {
    test::SeededRandom random(9);
    const std::vector<Rigid> flat = test::waved_board(task.board, 14, 1e-4, random);
    for (CalibrationPicture& picture : task.pictures)
        picture.sighting = sighting_of(truth[picture.camera], flat[picture.moment], random);
    const auto found = calibrate(task, [](double) {});
    // Either no answer, or one that says how little it knows. Camera 0 looks at it 12 degrees askew.
    if (found) {
        EXPECT_GT(found->uncertainty[0].fx_px, 0.1);
    }
}

}  // namespace
}  // namespace rig::host
