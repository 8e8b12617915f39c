#include "core/track/sightings.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Sightings, PointsKeepTheirIndexAndLoseTheHostile) {
    auto set = std::make_unique<SightingSet>();
    const std::vector<Vec3> points{{1.0, 2.0, 3.0},   {kNan, 0.0, 0.0},    {0.0, kInfinity, 0.0},
                                   {1e38, 0.0, 0.0},  {0.0, 0.0, -1001.0}, {4.0, 5.0, 6.0},
                                   {5e-324, 0.0, 0.0}};
    add_point_view(points, 0.5, *set);
    ASSERT_EQ(set->view_count, 1);
    ASSERT_EQ(set->views[0].size(), 3U);
    EXPECT_EQ(set->source[0][0], 0);
    EXPECT_EQ(set->source[0][1], 5);
    EXPECT_EQ(set->source[0][2], 6);
    EXPECT_EQ(set->views[0][1].point_mm, (Vec3{4.0, 5.0, 6.0}));
    EXPECT_EQ(set->views[0][1].direction, (Vec3{0.0, 0.0, 0.0}));
    EXPECT_EQ(set->views[0][1].information, 4.0);
    EXPECT_FALSE(set->from_cameras);
}

TEST(Sightings, MorePointsThanTheCapacityAreCutOff) {
    auto set = std::make_unique<SightingSet>();
    const std::vector<Vec3> points(kMaxPoints + 500, Vec3{1.0, 1.0, 1.0});
    add_point_view(points, 0.1, *set);
    EXPECT_EQ(set->views[0].size(), kMaxSightings);
    EXPECT_EQ(set->source[0].size(), kMaxSightings);
}

// A slot number that does not fit must not come out as another slot.
TEST(Sightings, SlotsBeyondSixteenBitsAreLeftOut) {
    auto set = std::make_unique<SightingSet>();
    std::vector<Vec3> points(65'540, Vec3{kNan, 0.0, 0.0});
    points[65'535] = Vec3{1.0, 1.0, 1.0};
    points[65'538] = Vec3{2.0, 2.0, 2.0};
    add_point_view(points, 0.1, *set);
    ASSERT_EQ(set->views[0].size(), 1U);
    EXPECT_EQ(set->source[0][0], 65'535);
}

TEST(Sightings, WhatWasCompletedWeighsLess) {
    test::SyntheticFaceOptions options;
    options.camera_count = 1;
    const test::SyntheticFace face(options);
    const std::vector<Observation> seen{{100.0F, 200.0F, 8.0F, 0.5F, 0.9F, 0.0F},
                                        {150.0F, 200.0F, 8.0F, 0.5F, 0.9F, 0.6F},
                                        {200.0F, 200.0F, 8.0F, 0.5F, 0.9F, 0.1F}};
    auto set = std::make_unique<SightingSet>();
    add_camera_view(face.pack().cameras[0], seen, 0.2, 210.0, *set);
    ASSERT_EQ(set->views[0].size(), 3U);
    const auto& view = set->views[0];
    EXPECT_NEAR(view[0].information, 9.0 * view[1].information, 1e-5 * view[0].information);
    EXPECT_EQ(view[0].information, view[2].information);
}

TEST(Sightings, CameraRaysCarryTheirNoiseInMillimetres) {
    test::SyntheticFaceOptions options;
    options.camera_count = 2;
    const test::SyntheticFace face(options);
    const CameraModel camera = face.pack().cameras[1];
    const std::vector<Observation> seen{{100.0F, 200.0F, 8.0F, 0.5F, 0.9F},
                                        {320.0F, 240.0F, 8.0F, 0.5F, 0.9F}};
    auto set = std::make_unique<SightingSet>();
    add_camera_view(camera, seen, 0.2, 210.0, *set);
    ASSERT_EQ(set->views[0].size(), 2U);
    EXPECT_TRUE(set->from_cameras);
    const double sigma_mm = 0.2 * 210.0 / (0.5 * (camera.fx_px + camera.fy_px));
    for (std::size_t i = 0; i < 2; ++i) {
        const Sighting& s = set->views[0][i];
        EXPECT_NEAR(s.information * sigma_mm * sigma_mm, 1.0, 1e-12);
        EXPECT_EQ(s.point_mm, camera.centre_mm);
        const test::ReferencePixel back = test::reference_project(camera, s.point_mm + 150.0 * s.direction);
        EXPECT_NEAR(static_cast<double>(back.x_px), static_cast<double>(seen[i].x_px), 1e-6);
        EXPECT_NEAR(static_cast<double>(back.y_px), static_cast<double>(seen[i].y_px), 1e-6);
    }
}

TEST(Sightings, HostilePixelsMakeUnitRaysOrNothing) {
    test::SyntheticFaceOptions options;
    options.camera_count = 1;
    const test::SyntheticFace face(options);
    std::vector<CameraModel> cameras{face.pack().cameras[0], face.pack().cameras[0]};
    cameras[1].k1 = cameras[1].k2 = cameras[1].k3 = cameras[1].p1 = cameras[1].p2 = 0.0;
    const auto nan = std::numeric_limits<float>::quiet_NaN();
    const auto infinity = std::numeric_limits<float>::infinity();
    std::vector<Observation> seen;
    for (const float x : {nan, infinity, -infinity, 1e38F, -1e38F, 1e20F, 1e-40F, 0.0F, -3000.0F}) {
        for (const float y : {nan, 1e38F, 0.0F, 5000.0F}) seen.push_back({x, y, nan, nan, nan});
    }
    for (const CameraModel& camera : cameras) {
        auto set = std::make_unique<SightingSet>();
        add_camera_view(camera, seen, 0.2, 210.0, *set);
        for (const Sighting& s : set->views[0]) EXPECT_NEAR(s.direction.norm(), 1.0, 1e-9);
        EXPECT_GE(set->views[0].size(), 2U);
    }
}

TEST(Sightings, ClearForgetsEverything) {
    auto set = std::make_unique<SightingSet>();
    test::SyntheticFaceOptions options;
    options.camera_count = 1;
    const test::SyntheticFace face(options);
    const std::vector<Observation> seen(3, Observation{100.0F, 100.0F, 8.0F, 0.5F, 0.9F});
    add_camera_view(face.pack().cameras[0], seen, 0.2, 210.0, *set);
    set->clear();
    EXPECT_EQ(set->view_count, 0);
    EXPECT_TRUE(set->views[0].empty());
    EXPECT_TRUE(set->source[0].empty());
    EXPECT_FALSE(set->from_cameras) << "a marker stream after camera frames is not from cameras";
}

TEST(Sightings, CarryTheDelayOfTheirRow) {
    CameraModel camera;
    camera.width_px = 640;
    camera.height_px = 481;
    camera.fx_px = camera.fy_px = 500.0;
    camera.cx_px = 319.5;
    camera.cy_px = 240.0;
    std::vector<Observation> dots(3);
    dots[0].x_px = dots[1].x_px = dots[2].x_px = 300.0F;
    dots[1].y_px = 240.0F;
    dots[2].y_px = 480.0F;
    for (const double row_time_us : {0.0, 25.0}) {
        camera.row_time_us = row_time_us;
        auto set = std::make_unique<SightingSet>();
        add_camera_view(camera, dots, 0.1, 200.0, *set);
        ASSERT_EQ(set->views[0].size(), 3U);
        EXPECT_EQ(set->views[0][0].delay_us, -240.0 * row_time_us);
        EXPECT_EQ(set->views[0][1].delay_us, 0.0);
        EXPECT_EQ(set->views[0][2].delay_us, 240.0 * row_time_us);
    }
}

}  // namespace
}  // namespace rig
