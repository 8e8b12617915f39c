#include "core/geometry/triangulation.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "core/base/math.hpp"
#include "tests/support/random.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

Sighting ray_to(const Vec3& from, const Vec3& target, double information) {
    return {from, (target - from).normalized(), information};
}

TEST(Triangulation, TwoRaysMeet) {
    test::SeededRandom random(31);
    for (int i = 0; i < 200; ++i) {
        const Vec3 target{random.uniform(-70.0, 70.0), random.uniform(-100.0, 60.0),
                          random.uniform(-60.0, 30.0)};
        const std::array<Sighting, 2> rays{ray_to({-70.0, -45.0, 200.0}, target, 250.0),
                                           ray_to({70.0, -45.0, 200.0}, target, 250.0)};
        const Vec3 guess = target + Vec3{1.0, -1.0, 2.0};
        const Triangulation met = triangulate(rays, guess, 1e-9);
        EXPECT_LT((met.position_mm - target).norm(), 1e-7);
        EXPECT_LT(met.gap_mm, 2e-5);  // a root of a cancelled square: half the digits
        EXPECT_GT(met.information.determinant(), 0.0);
    }
}

TEST(Triangulation, SkewRaysMeetHalfwayAndTellTheGap) {
    // Two perpendicular rays 0.6 mm apart at their nearest points.
    const std::array<Sighting, 2> rays{Sighting{{0.0, 0.0, 0.3}, {1.0, 0.0, 0.0}, 100.0},
                                       Sighting{{0.0, 0.0, -0.3}, {0.0, 1.0, 0.0}, 100.0}};
    const Triangulation equal = triangulate(rays, Vec3{0.1, -0.1, 0.0}, 1e-9);
    EXPECT_LT((equal.position_mm - Vec3{0.0, 0.0, 0.0}).norm(), 1e-9);
    EXPECT_NEAR(equal.gap_mm, 0.3, 1e-9);
    // Three times the information on the first: the point divides the gap 1 to 3.
    std::array<Sighting, 2> unequal = rays;
    unequal[0].information = 300.0;
    const Triangulation pulled = triangulate(unequal, Vec3::Zero(), 1e-9);
    EXPECT_NEAR(pulled.position_mm[2], 0.15, 1e-9);
    EXPECT_NEAR(pulled.gap_mm, 0.45, 1e-9);
}

TEST(Triangulation, OneRayTakesTheExpectedDepth) {
    test::SeededRandom random(33);
    for (int i = 0; i < 100; ++i) {
        const Vec3 target{random.uniform(-50.0, 50.0), random.uniform(-50.0, 50.0),
                          random.uniform(-50.0, 20.0)};
        const std::array<Sighting, 1> rays{ray_to({0.0, -40.0, 210.0}, target, 250.0)};
        const Vec3 expected = target + 4.0 * rays[0].direction + Vec3{0.3, -0.2, 0.1};
        const Triangulation found = triangulate(rays, expected, 1e-6);
        // On the ray, at the foot of the expected position.
        EXPECT_LT(found.gap_mm, 2e-5);
        EXPECT_NEAR((found.position_mm - expected).dot(rays[0].direction), 0.0, 1e-4);
        // Nothing is claimed to be known along the ray.
        EXPECT_NEAR(found.information.determinant(), 0.0, 1e-6);
        EXPECT_NEAR((found.information * rays[0].direction).norm(), 0.0, 1e-10);
        EXPECT_NEAR(found.information.trace(), 500.0, 1e-9);
    }
}

TEST(Triangulation, APointIsItself) {
    const Vec3 point{12.0, -30.0, 5.0};
    const std::array<Sighting, 1> seen{Sighting{point, Vec3::Zero(), 100.0}};
    const Triangulation found = triangulate(seen, point + Vec3{2.0, 2.0, 2.0}, 1e-9);
    EXPECT_LT((found.position_mm - point).norm(), 1e-9);
    EXPECT_LT((found.information - 100.0 * Mat3::Identity()).norm(), 1e-12);
}

TEST(Triangulation, ErrorOfTheAnswerHasTheStatedInformation) {
    // Rays through a noisy pixel plane: the spread of the answers is the inverse of the information, within
    // sampling.
    test::SeededRandom random(34);
    const Vec3 target{10.0, -20.0, 5.0};
    const std::array<Vec3, 2> centres{Vec3{-70.0, -45.0, 200.0}, Vec3{70.0, -45.0, 200.0}};
    constexpr double kSigmaMm = 0.05;
    constexpr int kSamples = 4000;
    Mat3 spread = Mat3::Zero();
    Mat3 claimed = Mat3::Zero();
    for (int i = 0; i < kSamples; ++i) {
        std::array<Sighting, 2> rays;
        for (std::size_t c = 0; c < 2; ++c) {
            const Vec3 shaken = target + Vec3{random.normal(0.0, kSigmaMm), random.normal(0.0, kSigmaMm),
                                              random.normal(0.0, kSigmaMm)};
            rays[c] = ray_to(centres[c], shaken, 1.0 / (kSigmaMm * kSigmaMm));
        }
        const Triangulation found = triangulate(rays, target, 1e-9);
        const Vec3 error = found.position_mm - target;
        spread += error * error.transpose() / kSamples;
        claimed = found.information;
    }
    const Mat3 product = spread * claimed;
    EXPECT_LT((product - Mat3::Identity()).cwiseAbs().maxCoeff(), 0.12);
}

TEST(Triangulation, InverseOfAMatrix) {
    test::SeededRandom random(35);
    for (int i = 0; i < 100; ++i) {
        Mat3 a;
        for (Eigen::Index r = 0; r < 3; ++r) {
            for (Eigen::Index c = 0; c < 3; ++c) a(r, c) = random.normal(0.0, 1.0);
        }
        const Mat3 spd = a * a.transpose() + 0.1 * Mat3::Identity();
        const Mat3 product = spd * inverse_3x3(spd);
        EXPECT_LT((product - Mat3::Identity()).cwiseAbs().maxCoeff(), 1e-11);
    }
}

// Two to four helmet cameras with bent lenses, of both kinds.
std::vector<CameraModel> helmet(std::size_t count) {
    const std::array<Vec3, 4> centres{Vec3{-45.0, -48.0, 228.0}, Vec3{45.0, -48.0, 228.0},
                                      Vec3{0.0, -100.0, 228.0}, Vec3{0.0, 30.0, 228.0}};
    std::vector<CameraModel> cameras;
    for (std::size_t c = 0; c < count; ++c) {
        CameraModel camera;
        camera.width_px = 480;
        camera.height_px = 640;
        camera.fx_px = camera.fy_px = 598.0 + static_cast<double>(c);
        camera.cx_px = 239.0;
        camera.cy_px = 321.0;
        camera.lens = c % 2 == 0 ? LensModel::kRational : LensModel::kFisheye;
        camera.k1 = -0.1;
        camera.k2 = 0.02;
        camera.k4 = 0.01;
        camera.centre_mm = centres[c];
        const Vec3 forward = (Vec3{0.0, -33.0, 20.0} - camera.centre_mm).normalized();
        const Vec3 down = (Vec3{0.0, -1.0, 0.0} + forward[1] * forward).normalized();
        camera.camera_from_headset.row(0) = down.cross(forward).transpose();
        camera.camera_from_headset.row(1) = down.transpose();
        camera.camera_from_headset.row(2) = forward.transpose();
        cameras.push_back(camera);
    }
    return cameras;
}

std::vector<PixelSighting> seen_by(const std::vector<CameraModel>& cameras, const Vec3& point,
                                   double sigma_px, test::SeededRandom& random) {
    std::vector<PixelSighting> sightings;
    for (const CameraModel& camera : cameras) {
        const test::ReferencePixel at = test::reference_project(camera, point);
        sightings.push_back({&camera,
                             Vec2{static_cast<double>(at.x_px) + random.normal(0.0, sigma_px),
                                  static_cast<double>(at.y_px) + random.normal(0.0, sigma_px)},
                             sigma_px > 0.0 ? sigma_px : 1.0});
    }
    return sightings;
}

Vec3 face_point(test::SeededRandom& random) {
    return {random.uniform(-50.0, 50.0), random.uniform(-80.0, 20.0), random.uniform(-20.0, 40.0)};
}

TEST(TriangulatePixels, ExactPixelsGiveThePoint) {
    test::SeededRandom random(51);
    for (std::size_t count = 2; count <= 4; ++count) {
        const std::vector<CameraModel> cameras = helmet(count);
        for (int i = 0; i < 100; ++i) {
            const Vec3 point = face_point(random);
            const PointFit fit = triangulate_pixels(seen_by(cameras, point, 0.0, random));
            ASSERT_TRUE(fit.known);
            EXPECT_LT((fit.position_mm - point).norm(), 1e-9);
            EXPECT_LT(fit.rms_px, 1e-9);
        }
    }
}

// Squared error in long double, of the pixels in units of their sigmas.
long double cost_of(const std::vector<PixelSighting>& sightings, const Vec3& at) {
    long double cost = 0.0L;
    for (const PixelSighting& each : sightings) {
        const test::ReferencePixel p = test::reference_project(*each.camera, at);
        const long double dx = (static_cast<long double>(each.pixel[0]) - p.x_px) / each.sigma_px;
        const long double dy = (static_cast<long double>(each.pixel[1]) - p.y_px) / each.sigma_px;
        cost += dx * dx + dy * dy;
    }
    return cost;
}

// No neighbour costs less, by the independent formula; sigmas differ between the cameras.
TEST(TriangulatePixels, NoisyPixelsGiveTheLeastSquaresPoint) {
    test::SeededRandom random(52);
    for (std::size_t count = 2; count <= 4; ++count) {
        const std::vector<CameraModel> cameras = helmet(count);
        for (int i = 0; i < 100; ++i) {
            auto sightings = seen_by(cameras, face_point(random), 0.3, random);
            for (std::size_t c = 0; c < count; ++c)
                sightings[c].sigma_px = 0.1 + 0.2 * static_cast<double>(c);
            const PointFit fit = triangulate_pixels(sightings);
            ASSERT_TRUE(fit.known);
            const long double least = cost_of(sightings, fit.position_mm);
            for (int axis = 0; axis < 3; ++axis) {
                for (const double step : {-1e-4, 1e-4}) {
                    Vec3 beside = fit.position_mm;
                    beside[axis] += step;
                    EXPECT_GT(cost_of(sightings, beside), least);
                }
            }
        }
    }
}

// What the covariance claims is what repetition shows: (x - truth)^T C^-1 (x - truth) is chi-squared with 3.
TEST(TriangulatePixels, CovarianceIsWhatRepetitionShows) {
    test::SeededRandom random(53);
    for (std::size_t count = 2; count <= 4; ++count) {
        const std::vector<CameraModel> cameras = helmet(count);
        const Vec3 point = face_point(random);
        Mat3 spread = Mat3::Zero();
        Mat3 claimed = Mat3::Zero();
        double mahalanobis = 0.0;
        constexpr int kDraws = 6000;
        for (int i = 0; i < kDraws; ++i) {
            const PointFit fit = triangulate_pixels(seen_by(cameras, point, 0.1, random));
            ASSERT_TRUE(fit.known);
            const Vec3 off = fit.position_mm - point;
            spread += off * off.transpose() / kDraws;
            claimed += fit.covariance_mm2 / kDraws;
            mahalanobis += off.dot(fit.information * off) / kDraws;
        }
        // A variance from 6000 draws is good to 1.8 % (one sigma).
        EXPECT_NEAR(mahalanobis, 3.0, 0.15) << count;
        for (int axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(spread(axis, axis) / claimed(axis, axis), 1.0, 0.08) << count;
    }
}

TEST(TriangulatePixels, SaysWhenDepthIsOpen) {
    test::SeededRandom random(54);
    std::vector<CameraModel> cameras = helmet(2);
    auto sightings = seen_by(cameras, Vec3{0.0, -30.0, 10.0}, 0.0, random);
    EXPECT_FALSE(triangulate_pixels({}).known);
    EXPECT_FALSE(triangulate_pixels(std::span(sightings).first(1)).known);
    sightings[1] = sightings[0];
    EXPECT_FALSE(triangulate_pixels(sightings).known) << "the same ray twice";
    // Rays that meet behind the cameras.
    sightings = seen_by(cameras, Vec3{0.0, -30.0, 10.0}, 0.0, random);
    std::swap(sightings[0].pixel, sightings[1].pixel);
    sightings[0].pixel[0] -= 200.0;
    sightings[1].pixel[0] += 200.0;
    const PointFit behind = triangulate_pixels(sightings);
    EXPECT_TRUE(is_finite(behind.position_mm[2]));
}

TEST(CovarianceFromInformation, RefusesWhatOneRayLeavesOpen) {
    Mat3 covariance = Mat3::Zero();
    const std::array<Sighting, 1> ray{ray_to({0.0, -40.0, 210.0}, Vec3{3.0, 2.0, 1.0}, 250.0)};
    const Triangulation one = triangulate(ray, Vec3{3.0, 2.0, 1.0}, 1e-6);
    EXPECT_FALSE(covariance_from_information(one.information, 100.0, covariance));
    Mat3 information = Mat3::Identity();
    information(0, 0) = 4.0;
    EXPECT_TRUE(covariance_from_information(information, 100.0, covariance));
    EXPECT_DOUBLE_EQ(covariance(0, 0), 0.25);
    information(1, 1) = std::nan("");
    EXPECT_FALSE(covariance_from_information(information, 100.0, covariance));
}

}  // namespace
}  // namespace rig
