#include "core/pipeline/expected_markers.hpp"

#include <gtest/gtest.h>

#include <array>

namespace {

using namespace rig;

// Looks along +z of the headset frame from 200 mm in front of its origin's plane: 3 px/mm at the origin.
CameraModel camera() {
    CameraModel camera;
    camera.width_px = 640;
    camera.height_px = 480;
    camera.fx_px = camera.fy_px = 600.0;
    camera.cx_px = 320.0;
    camera.cy_px = 240.0;
    camera.centre_mm = Vec3(0.0, 0.0, -200.0);
    return camera;
}

struct Face {
    std::array<Vec3, 4> position_mm{Vec3(0.0, 0.0, 0.0), Vec3(10.0, -5.0, 0.0), Vec3(200.0, 0.0, 0.0),
                                    Vec3(0.0, 0.0, -400.0)};
    std::array<std::uint16_t, 4> missed{};
    std::array<std::int16_t, 4> last_match{};
    [[nodiscard]] MarkerPrediction prediction() const { return {position_mm, missed, last_match}; }
};

TEST(ExpectedMarkers, AreWhereTheCameraSeesThem) {
    ExpectedMarkers expected;
    expect_markers(camera(), 0, Face{}.prediction(), {}, expected);
    ASSERT_EQ(expected.size(), 2U) << "neither beside the picture nor behind the camera";
    EXPECT_NEAR(expected[0].x_px, 320.0F, 1e-3F);
    EXPECT_NEAR(expected[1].x_px, 350.0F, 1e-3F);
    EXPECT_NEAR(expected[1].y_px, 225.0F, 1e-3F);
    EXPECT_NEAR(expected[0].reach_px, 9.0F, 1e-3F) << "3 mm";
    EXPECT_TRUE(expected[0].surely);
}

TEST(ExpectedMarkers, ThoseUnseenAreSoughtFartherAndNotMissed) {
    Face face;
    face.missed[0] = 2;
    face.last_match[0] = -1;
    face.missed[1] = 60000;
    ExpectedMarkers expected;
    expect_markers(camera(), 0, face.prediction(), {}, expected);
    ASSERT_EQ(expected.size(), 2U);
    EXPECT_NEAR(expected[0].reach_px, 15.0F, 1e-3F);
    EXPECT_FALSE(expected[0].surely);
    EXPECT_LE(expected[1].reach_px, kMaxReachPx);
}

TEST(ExpectedMarkers, TheHelmetsOwnMarksAreAmongThemForTheCamerasThatSeeThem) {
    const std::array<HelmetMark, 2> marks{HelmetMark{Vec3(20.0, 20.0, 0.0), 1},
                                          HelmetMark{Vec3(-20.0, 20.0, 0.0), 2}};
    ExpectedMarkers expected;
    expect_markers(camera(), 1, Face{}.prediction(), marks, expected);
    ASSERT_EQ(expected.size(), 3U);
    EXPECT_NEAR(expected[2].x_px, 260.0F, 1e-3F);
    EXPECT_FALSE(expected[2].surely);
}

}  // namespace
