#include "core/geometry/pnp.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/base/math.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

// A camera on a tripod: half a metre to a metre in front of where heads are; its own place is the reference.
CameraModel tripod_camera() {
    CameraModel camera;
    camera.width_px = 1280;
    camera.height_px = 960;
    camera.fx_px = 1400.0;
    camera.fy_px = 1404.0;
    camera.cx_px = 640.0;
    camera.cy_px = 480.0;
    camera.k1 = -0.08;
    camera.k2 = 0.03;
    camera.p1 = 3e-4;
    camera.camera_from_headset << 1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0;
    camera.centre_mm = Vec3{0.0, 0.0, 700.0};
    return camera;
}

Rigid random_pose(test::SeededRandom& random) {
    const Vec3 turn{random.uniform(-0.5, 0.5), random.uniform(-0.7, 0.7), random.uniform(-0.5, 0.5)};
    return {rotation_from_vector(turn),
            Vec3{random.uniform(-120.0, 120.0), random.uniform(-80.0, 80.0), random.uniform(-300.0, 150.0)}};
}

std::vector<NamedPixel> seen_from(const CameraModel& camera, const std::vector<Vec3>& face, const Rigid& pose,
                                  double sigma_px, test::SeededRandom& random) {
    std::vector<NamedPixel> points;
    for (const Vec3& at : face) {
        const test::ReferencePixel p = test::reference_project(camera, pose.apply(at));
        points.push_back({&camera, at,
                          Vec2{static_cast<double>(p.x_px) + random.normal(0.0, sigma_px),
                               static_cast<double>(p.y_px) + random.normal(0.0, sigma_px)}});
    }
    return points;
}

double turn_between(const Rigid& a, const Rigid& b) {
    const Mat3 between = a.rotation * b.rotation.transpose();
    return vector_from_rotation(between).norm();
}

std::vector<Vec3> face_points(std::size_t count) {
    const test::SyntheticFace face({.marker_count = count});
    return face.positions(face.weights_at(0.7));
}

TEST(SolvePnp, FindsThePoseExactlyWithoutNoiseFromNothing) {
    test::SeededRandom random(21);
    const CameraModel camera = tripod_camera();
    for (const std::size_t count : {8U, 20U, 60U}) {
        const std::vector<Vec3> face = face_points(count);
        for (int i = 0; i < 200; ++i) {
            const Rigid pose = random_pose(random);
            const HeadPose found = solve_pnp(seen_from(camera, face, pose, 0.0, random), {});
            ASSERT_TRUE(found.known) << count << ' ' << i << " refusal " << static_cast<int>(found.refusal);
            EXPECT_LT(turn_between(found.reference_from_face, pose), 1e-7);
            EXPECT_LT((found.reference_from_face.translation_mm - pose.translation_mm).norm(), 1e-5);
            EXPECT_EQ(found.points_used, count);
        }
    }
}

// Errors at 0.1 px, and that the claimed deviations are what repetition shows.
TEST(SolvePnp, ErrorsAtATenthOfAPixelAreWhatItClaims) {
    test::SeededRandom random(22);
    const CameraModel camera = tripod_camera();
    const std::vector<Vec3> face = face_points(60);
    Vec3 centroid = Vec3::Zero();
    for (const Vec3& at : face) centroid += at / 60.0;
    PnpConfig config;
    config.sigma_px = 0.1;
    double turn2 = 0.0;
    double shift2 = 0.0;
    double across2 = 0.0;
    Vec3 turn_ratio2 = Vec3::Zero();
    Vec3 shift_ratio2 = Vec3::Zero();
    constexpr int kPoses = 1500;
    for (int i = 0; i < kPoses; ++i) {
        const Rigid pose = random_pose(random);
        const HeadPose found = solve_pnp(seen_from(camera, face, pose, 0.1, random), config);
        ASSERT_TRUE(found.known) << i;
        const Mat3 between = found.reference_from_face.rotation * pose.rotation.transpose();
        const Vec3 turn = vector_from_rotation(between);
        const Vec3 shift = found.reference_from_face.apply(centroid) - pose.apply(centroid);
        turn2 += turn.squaredNorm() / kPoses;
        shift2 += shift.squaredNorm() / kPoses;
        across2 += (shift[0] * shift[0] + shift[1] * shift[1]) / kPoses;
        for (int a = 0; a < 3; ++a) {
            turn_ratio2[a] += std::pow(turn[a] / found.rotation_sigma_rad[a], 2) / kPoses;
            shift_ratio2[a] += std::pow(shift[a] / found.translation_sigma_mm[a], 2) / kPoses;
        }
    }
    std::printf("60 markers at 0.55 to 1 m, 0.1 px: turn %.4f degrees rms, centroid %.3f mm (%.3f across)\n",
                std::sqrt(turn2) * 180.0 / std::numbers::pi, std::sqrt(shift2), std::sqrt(across2));
    EXPECT_LT(std::sqrt(turn2), 0.002);
    EXPECT_LT(std::sqrt(across2), 0.1);
    for (int a = 0; a < 3; ++a) {
        EXPECT_NEAR(std::sqrt(turn_ratio2[a]), 1.0, 0.15) << a;
        EXPECT_NEAR(std::sqrt(shift_ratio2[a]), 1.0, 0.15) << a;
    }
}

TEST(SolvePnp, WrongNamesDoNotTurnTheHead) {
    test::SeededRandom random(23);
    const CameraModel camera = tripod_camera();
    const std::vector<Vec3> face = face_points(60);
    int known = 0;
    for (int i = 0; i < 300; ++i) {
        const Rigid pose = random_pose(random);
        std::vector<NamedPixel> points = seen_from(camera, face, pose, 0.1, random);
        for (int k = 0; k < 3; ++k) {  // three pairs swapped: a tenth of all
            const std::size_t a = random.bits() % 60;
            const std::size_t b = random.bits() % 60;
            std::swap(points[a].pixel, points[b].pixel);
        }
        const HeadPose found = solve_pnp(points, {});
        if (!found.known) continue;
        ++known;
        EXPECT_LT(turn_between(found.reference_from_face, pose), 0.01) << i;
        EXPECT_LT((found.reference_from_face.translation_mm - pose.translation_mm).norm(), 5.0) << i;
    }
    std::printf("with a tenth of the names wrong: %d of 300 poses known\n", known);
    EXPECT_GE(known, 285);
}

TEST(SolvePnp, ThePoseBeforeHelpsWhereTheLinearStartFails) {
    test::SeededRandom random(24);
    const CameraModel camera = tripod_camera();
    const std::vector<Vec3> face = face_points(24);
    for (int i = 0; i < 100; ++i) {
        const Rigid pose = random_pose(random);
        HeadPose before;
        before.known = true;
        before.reference_from_face = pose;
        before.reference_from_face.translation_mm += Vec3{3.0, -2.0, 4.0};
        std::vector<NamedPixel> points = seen_from(camera, face, pose, 0.1, random);
        for (int k = 0; k < 4; ++k)
            std::swap(points[static_cast<std::size_t>(k)].pixel,
                      points[23U - static_cast<std::size_t>(k)].pixel);
        const HeadPose found = solve_pnp(points, {}, before);
        ASSERT_TRUE(found.known) << i;
        EXPECT_EQ(found.points_used, 16);
        EXPECT_LT(turn_between(found.reference_from_face, pose), 0.01);
    }
}

// Eight names of 24 are swapped: from nothing hardly any frame has an answer, from the last pose all have.
// The frames between, of which too little is seen, must not take that pose away.
TEST(TrackPnp, ARefusedFrameLeavesTheNextItsStart) {
    test::SeededRandom random(24);
    const CameraModel camera = tripod_camera();
    const std::vector<Vec3> face = face_points(24);
    const PnpConfig config;
    int from_nothing = 0;
    for (int i = 0; i < 60; ++i) {
        const Rigid pose = random_pose(random);
        HeadPose start;
        ASSERT_TRUE(track_pnp(seen_from(camera, face, pose, 0.1, random), config, start).known);
        const std::vector<NamedPixel> whole = seen_from(camera, face, pose, 0.1, random);
        const HeadPose little = track_pnp(std::span(whole).first(5), config, start);
        EXPECT_FALSE(little.known);
        EXPECT_EQ(little.refusal, PnpRefusal::kTooFew);
        EXPECT_TRUE(start.known);
        std::vector<NamedPixel> swapped = whole;
        for (std::size_t k = 0; k < 4; ++k) std::swap(swapped[k].pixel, swapped[23U - k].pixel);
        const HeadPose found = track_pnp(swapped, config, start);
        ASSERT_TRUE(found.known) << i;
        EXPECT_LT(turn_between(found.reference_from_face, pose), 0.01);
        const HeadPose nothing = solve_pnp(swapped, config);
        from_nothing += nothing.known && turn_between(nothing.reference_from_face, pose) < 0.01 ? 1 : 0;
    }
    std::printf("a third of the names swapped: 60 of 60 with the pose before, %d from nothing\n",
                from_nothing);
    EXPECT_LT(from_nothing, 55) << "the linear start does it alone: this test shows nothing any more";
}

TEST(SolvePnp, TwoCamerasKnowTheDepthBetter) {
    test::SeededRandom random(25);
    const std::vector<Vec3> face = face_points(40);
    std::array<CameraModel, 2> cameras{tripod_camera(), tripod_camera()};
    cameras[1].centre_mm = Vec3{500.0, 0.0, 500.0};
    const Mat3 turn = rotation_from_vector(Vec3{0.0, -0.78, 0.0});
    cameras[1].camera_from_headset = cameras[0].camera_from_headset * turn;
    const Rigid pose{rotation_from_vector(Vec3{0.1, -0.2, 0.05}), Vec3{10.0, 5.0, -20.0}};
    std::vector<NamedPixel> one = seen_from(cameras[0], face, pose, 0.1, random);
    std::vector<NamedPixel> both = one;
    for (const NamedPixel& p : seen_from(cameras[1], face, pose, 0.1, random)) both.push_back(p);
    const HeadPose from_one = solve_pnp(one, {});
    const HeadPose from_both = solve_pnp(both, {});
    ASSERT_TRUE(from_one.known && from_both.known);
    EXPECT_EQ(from_both.points_used, 80);
    EXPECT_LT(from_both.translation_sigma_mm[2], 0.5 * from_one.translation_sigma_mm[2]);
    EXPECT_LT(turn_between(from_both.reference_from_face, pose), 0.003);
}

TEST(SolvePnp, RefusesWhatTellsNoPose) {
    test::SeededRandom random(26);
    const CameraModel camera = tripod_camera();
    const Rigid pose = random_pose(random);
    std::vector<Vec3> face = face_points(20);
    const auto refusal = [&](const std::vector<NamedPixel>& points) {
        const HeadPose found = solve_pnp(points, {});
        EXPECT_FALSE(found.known);
        return found.refusal;
    };
    EXPECT_EQ(refusal({}), PnpRefusal::kTooFew);
    std::vector<NamedPixel> points = seen_from(camera, face, pose, 0.1, random);
    EXPECT_EQ(refusal({points.begin(), points.begin() + 5}), PnpRefusal::kTooFew);
    std::vector<Vec3> flat = face;
    for (Vec3& at : flat) at[2] = 0.3 * at[0];
    EXPECT_EQ(refusal(seen_from(camera, flat, pose, 0.1, random)), PnpRefusal::kFlat);
    std::vector<Vec3> line = face;
    for (Vec3& at : line) at = Vec3{at[0], 2.0 * at[0], -at[0]};
    EXPECT_EQ(refusal(seen_from(camera, line, pose, 0.1, random)), PnpRefusal::kFlat);
    const std::vector<Vec3> same(20, Vec3{1.0, 2.0, 3.0});
    EXPECT_EQ(refusal(seen_from(camera, same, pose, 0.1, random)), PnpRefusal::kFlat);
    // Another face altogether: names shuffled.
    for (std::size_t k = points.size(); k-- > 1;) std::swap(points[k].pixel, points[random.bits() % k].pixel);
    const HeadPose shuffled = solve_pnp(points, {});
    EXPECT_FALSE(shuffled.known);
    // Too far away for its pixels to tell.
    std::vector<Vec3> tiny = face;
    for (Vec3& at : tiny) at *= 0.002;
    EXPECT_EQ(refusal(seen_from(camera, tiny, pose, 0.0, random)), PnpRefusal::kUncertain);
}

TEST(SolvePnp, AnyNumbersAreSafe) {
    test::SeededRandom random(27);
    const CameraModel camera = tripod_camera();
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double inf = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 300; ++i) {
        std::vector<NamedPixel> points;
        for (int k = 0; k < 30; ++k) {
            const double reach = i % 3 == 0 ? 1e9 : 100.0;
            NamedPixel point{&camera,
                             Vec3{random.uniform(-reach, reach), random.uniform(-reach, reach),
                                  random.uniform(-reach, reach)},
                             Vec2{random.uniform(-3000.0, 3000.0), random.uniform(-3000.0, 3000.0)}};
            if (random.chance(0.05)) point.face_mm[1] = random.chance(0.5) ? nan : inf;
            if (random.chance(0.05)) point.pixel[0] = random.chance(0.5) ? nan : -inf;
            points.push_back(point);
        }
        const HeadPose a = solve_pnp(points, {});
        const HeadPose b = solve_pnp(points, {});
        EXPECT_EQ(a.reference_from_face.rotation, b.reference_from_face.rotation);
        EXPECT_FALSE(a.known);
        EXPECT_TRUE(std::isfinite(a.rms_px));
        for (int r = 0; r < 3; ++r) EXPECT_TRUE(std::isfinite(a.reference_from_face.translation_mm[r]));
    }
}

}  // namespace
}  // namespace rig
