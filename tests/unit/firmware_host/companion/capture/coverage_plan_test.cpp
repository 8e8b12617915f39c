#include "firmware_host/companion/capture/coverage_plan.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/board_scene/board_scene.hpp"
#include "tests/support/text_checks.hpp"
#include "tests/unit/firmware_host/companion/capture/board_views.hpp"

namespace rig::host {
namespace {

using test::has;

class CoveragePlanned : public testing::Test {
  protected:
    CoveragePlanned() {
        board = *parse_board("charuco:9x7:12");
        camera.width_px = 640;
        camera.height_px = 480;
        camera.fx_px = camera.fy_px = 600.0;
        camera.cx_px = 319.5;
        camera.cy_px = 239.5;
    }
    [[nodiscard]] BoardSighting seen(const Vec3& at_mm, const Vec3& turn_rad) const {
        return test::computed_sighting(board, camera, test::board_before_camera(board, at_mm, turn_rad));
    }
    [[nodiscard]] PictureSize size() const { return {camera.width_px, camera.height_px}; }

    BoardSpec board;
    CameraModel camera;
    std::vector<std::string> names{"left", "right"};
};

TEST_F(CoveragePlanned, TheLeanIsTheBoardsOwn) {
    struct Case {
        Vec3 turn_rad;
        BoardTilt tilt;
    };
    // Camera axes: x right, y down, z away. A turn by + about x takes the bottom away, by + about y the left.
    const std::vector<Case> cases{{{0.0, 0.0, 0.0}, BoardTilt::kFacing},
                                  {{0.5, 0.0, 0.0}, BoardTilt::kBottomAway},
                                  {{-0.5, 0.0, 0.0}, BoardTilt::kTopAway},
                                  {{0.0, 0.5, 0.0}, BoardTilt::kLeftAway},
                                  {{0.0, -0.5, 0.0}, BoardTilt::kRightAway}};
    for (const Case& each : cases) {
        for (const double x_mm : {-40.0, 0.0, 30.0}) {
            const auto lean = board_lean(board, seen({x_mm, 10.0, 260.0}, each.turn_rad), size());
            ASSERT_TRUE(lean.has_value());
            EXPECT_EQ(tilt_of(*lean), each.tilt) << each.turn_rad.transpose() << " at " << x_mm;
            // The guess of the focal length is 640 for 600.
            EXPECT_NEAR(std::hypot(lean->x, lean->y), std::sin(each.turn_rad.norm()) * 640.0 / 600.0, 0.06);
        }
    }
}

TEST_F(CoveragePlanned, TheLeanDoesNotDependOnHowTheBoardIsRolled) {
    for (const double roll : {-2.0, -0.7, 0.7, 1.57, 3.1}) {
        const Mat3 turn =
            rotation_from_vector(Vec3{-0.5, 0.0, 0.0}) * rotation_from_vector(Vec3{0.0, 0.0, roll});
        const auto lean = board_lean(board, seen({0.0, 0.0, 260.0}, vector_from_rotation(turn)), size());
        ASSERT_TRUE(lean.has_value());
        EXPECT_EQ(tilt_of(*lean), BoardTilt::kTopAway) << roll;
    }
}

TEST_F(CoveragePlanned, TooFewPointsHaveNoLean) {
    BoardSighting few = seen({0.0, 0.0, 260.0}, Vec3::Zero());
    few.points.resize(kLeastPoints - 1);
    EXPECT_FALSE(board_lean(board, few, size()).has_value());
}

TEST_F(CoveragePlanned, TheSameViewTwiceAddsNothing) {
    CoveragePlan plan(board, 1);
    const std::vector<PictureSize> sizes{size()};
    const std::vector<BoardSighting> view{seen({0.0, 0.0, 260.0}, {0.2, 0.0, 0.0})};
    EXPECT_TRUE(plan.adds(view, sizes));
    plan.take(view, sizes);
    EXPECT_FALSE(plan.adds(view, sizes));
    EXPECT_FALSE(plan.adds(std::vector{seen({3.0, 0.0, 262.0}, {0.22, 0.0, 0.0})}, sizes))
        << "a hand's tremor";
    EXPECT_TRUE(plan.adds(std::vector{seen({30.0, 0.0, 260.0}, {0.2, 0.0, 0.0})}, sizes)) << "another area";
    EXPECT_TRUE(plan.adds(std::vector{seen({0.0, 0.0, 260.0}, {-0.3, 0.0, 0.0})}, sizes)) << "another tilt";
    EXPECT_FALSE(plan.adds(std::vector<BoardSighting>(1), sizes)) << "no board";
}

TEST_F(CoveragePlanned, WithEnoughPicturesOnlyWhatIsLackingAdds) {
    CoverageGoal goal;
    goal.pictures = 1;
    goal.fields = 0.0;
    goal.each_tilt = 1;
    CoveragePlan plan(board, 1, goal);
    const std::vector<PictureSize> sizes{size()};
    plan.take(std::vector{seen({0.0, 0.0, 260.0}, {-0.5, 0.0, 0.0})}, sizes);
    EXPECT_FALSE(plan.adds(std::vector{seen({30.0, 0.0, 260.0}, {-0.5, 0.0, 0.0})}, sizes))
        << "top away again";
    EXPECT_FALSE(plan.adds(std::vector{seen({30.0, 0.0, 260.0}, {0.0, 0.0, 0.0})}, sizes))
        << "facing is no goal";
    EXPECT_TRUE(plan.adds(std::vector{seen({30.0, 0.0, 260.0}, {0.0, 0.5, 0.0})}, sizes));
    EXPECT_TRUE(has(plan.advice(names), "tilt the bottom of the board away from camera left"))
        << plan.advice(names);
}

TEST_F(CoveragePlanned, TheAdviceNamesTheEmptiestPartOfTheCameraThatLacksMost) {
    CoverageGoal most;
    most.fields = 0.95;
    CoveragePlan plan(board, 2, most);
    const std::vector<PictureSize> sizes{size(), size()};
    EXPECT_TRUE(has(plan.advice(names), "before camera left")) << plan.advice(names);
    // Everywhere but in the upper left of camera left.
    for (const double x_mm : {-50.0, 0.0, 50.0}) {
        for (const double y_mm : {-40.0, 0.0, 40.0}) {
            BoardSighting view = seen({x_mm, y_mm, 200.0}, Vec3::Zero());
            BoardSighting kept;
            for (std::size_t i = 0; i < view.points.size(); ++i) {
                if (view.x_px[i] < 300.0 && view.y_px[i] < 220.0) continue;
                kept.points.push_back(view.points[i]);
                kept.x_px.push_back(view.x_px[i]);
                kept.y_px.push_back(view.y_px[i]);
            }
            plan.take(std::vector{kept, view}, sizes);
        }
    }
    EXPECT_LT(plan.camera(0).share(), plan.camera(1).share());
    EXPECT_TRUE(has(plan.advice(names), "upper left of camera left")) << plan.advice(names);
}

TEST_F(CoveragePlanned, CamerasAreLinkedOverOthers) {
    CoverageGoal goal;
    goal.linked = 2;
    CoveragePlan plan(board, 3, goal);
    const std::vector<PictureSize> sizes(3, size());
    const BoardSighting view = seen({0.0, 0.0, 260.0}, Vec3::Zero());
    const BoardSighting none;
    for (int i = 0; i < 2; ++i) plan.take(std::vector{none, view, view}, sizes);
    EXPECT_TRUE(plan.camera(0).linked);
    EXPECT_FALSE(plan.camera(1).linked);
    EXPECT_FALSE(plan.camera(2).linked) << "linked to each other, not to the first";
    for (int i = 0; i < 2; ++i) plan.take(std::vector{view, view, none}, sizes);
    EXPECT_TRUE(plan.camera(1).linked);
    EXPECT_TRUE(plan.camera(2).linked);
    EXPECT_EQ(plan.shots(), 4U);
}

// A person who follows the wave of the other tests' board.
TEST_F(CoveragePlanned, AWavedBoardCompletesThePlanAndProgressNeverFalls) {
    const std::vector<CameraModel> cameras = test::board_rig(LensModel::kRational, 4);
    CoveragePlan plan(board, 4);
    std::vector<PictureSize> sizes;
    for (const CameraModel& each : cameras) sizes.push_back({each.width_px, each.height_px});
    const std::vector<std::string> four{"a", "b", "c", "d"};
    test::SeededRandom random(41);
    double before = plan.progress();
    std::size_t offered = 0;
    for (const Rigid& pose : test::waved_board(board, 120, 0.7, random)) {
        if (plan.complete()) break;
        EXPECT_FALSE(plan.advice(four).empty());
        std::vector<BoardSighting> views;
        for (const CameraModel& each : cameras) views.push_back(test::computed_sighting(board, each, pose));
        ++offered;
        if (!plan.adds(views, sizes)) continue;
        plan.take(views, sizes);
        EXPECT_GE(plan.progress(), before);
        before = plan.progress();
    }
    std::printf("complete after %zu shots of %zu views\n", plan.shots(), offered);
    EXPECT_TRUE(plan.complete());
    EXPECT_EQ(plan.progress(), 1.0);
    EXPECT_TRUE(plan.advice(four).empty());
    EXPECT_GE(plan.shots(), plan.goal().pictures);
}

}  // namespace
}  // namespace rig::host
