// Four cameras calibrated from drawn boards, against the numbers they were drawn with.
#include "firmware_host/companion/calibrate/calibration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "tests/support/board_scene/board_scene.hpp"

namespace rig::host {
namespace {

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

}  // namespace
}  // namespace rig::host
