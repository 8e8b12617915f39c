#include "firmware_host/companion/fit/take_moments.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "firmware_host/companion/fit/vertex_motion.hpp"
#include "tests/support/random.hpp"

namespace rig::host {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using test::SeededRandom;

MatrixXd random_matrix(SeededRandom& random, Index rows, Index columns, double deviation) {
    MatrixXd out(rows, columns);
    for (Index r = 0; r < rows; ++r) {
        for (Index c = 0; c < columns; ++c) out(r, c) = random.normal(0.0, deviation);
    }
    return out;
}

struct Scene {
    MarkerTake take;
    SolvedTake solved;
};

Scene random_scene(SeededRandom& random, std::size_t frames, std::size_t markers, Index shapes) {
    Scene scene;
    scene.take = {.frame_count = frames, .marker_count = markers, .rate_hz = 60.0, .positions_mm = {}};
    scene.solved.weights = random_matrix(random, static_cast<Index>(frames), shapes, 0.5);
    for (std::size_t f = 0; f < frames; ++f) {
        Rigid slip;
        slip.rotation = Eigen::AngleAxisd(random.uniform(-0.2, 0.2), Vec3::UnitY()).toRotationMatrix();
        slip.translation_mm = {random.uniform(-5, 5), 0.0, 1.0};
        scene.solved.headset_from_face.push_back(slip);
        scene.solved.solved.push_back(!random.chance(0.1));
        for (std::size_t k = 0; k < markers; ++k) {
            const bool hidden = random.chance(0.2);
            scene.take.positions_mm.push_back(
                hidden ? Vec3::Constant(std::numeric_limits<double>::infinity())
                       : Vec3(random.normal(80, 5), random.normal(-90, 5), random.normal(20, 5)));
        }
    }
    return scene;
}

// The same by the definition, in long double.
double mean_square_by_frames(const Scene& scene, std::size_t marker, const MatrixXd& motion, Vec3& mean) {
    long double sum = 0.0L;
    mean.setZero();
    double count = 0.0;
    for (std::size_t f = 0; f < scene.take.frame_count; ++f) {
        if (!scene.solved.solved[f] || !scene.take.seen(f, marker)) continue;
        Eigen::VectorXd z(motion.cols());
        z[0] = 1.0;
        z.tail(motion.cols() - 1) = scene.solved.weights.row(static_cast<Index>(f)).transpose();
        const Vec3 error =
            scene.solved.headset_from_face[f].apply_inverse(scene.take.at(f, marker)) - motion * z;
        sum += static_cast<long double>(error.squaredNorm());
        mean += error;
        count += 1.0;
    }
    mean /= count;
    return static_cast<double>(sum / static_cast<long double>(count));
}

TEST(TakeMoments, TellTheErrorOfAnyPlaceWithoutTheFrames) {
    SeededRandom random(7);
    const Scene scene = random_scene(random, 200, 3, 4);
    const std::vector<MarkerMoments> moments = take_moments(scene.take, scene.solved);
    for (std::size_t k = 0; k < 3; ++k) {
        for (int trial = 0; trial < 5; ++trial) {
            const MatrixXd motion = random_matrix(random, 3, 5, 30.0);
            Vec3 mean;
            const double expected = mean_square_by_frames(scene, k, motion, mean);
            EXPECT_NEAR(moments[k].mean_square_mm2(motion), expected, 1e-9 * expected);
            EXPECT_LT((moments[k].mean_error_mm(motion) - mean).norm(), 1e-9);
        }
    }
}

TEST(TakeMoments, AreEmptyForAMarkerNobodySaw) {
    SeededRandom random(8);
    Scene scene = random_scene(random, 30, 1, 2);
    for (Vec3& p : scene.take.positions_mm) p[1] = std::numeric_limits<double>::quiet_NaN();
    const std::vector<MarkerMoments> moments = take_moments(scene.take, scene.solved);
    EXPECT_EQ(moments[0].count, 0.0);
    EXPECT_EQ(moments[0].mean_square_mm2(random_matrix(random, 3, 3, 1.0)), 0.0);
    EXPECT_EQ(
        triangle_quadratic(moments[0], {MatrixXd::Ones(3, 3), MatrixXd::Ones(3, 3), MatrixXd::Ones(3, 3)})
            .constant,
        0.0);
}

TEST(TriangleQuadratic, IsTheMeanSquareOfTheBlend) {
    SeededRandom random(9);
    const Scene scene = random_scene(random, 100, 1, 3);
    const MarkerMoments moments = take_moments(scene.take, scene.solved)[0];
    const std::array<MatrixXd, 3> corners{random_matrix(random, 3, 4, 40.0),
                                          random_matrix(random, 3, 4, 40.0),
                                          random_matrix(random, 3, 4, 40.0)};
    const TriangleQuadratic quadratic = triangle_quadratic(moments, corners);
    const Vec3 b(0.2, 0.5, 0.3);
    const double expected =
        moments.mean_square_mm2(b[0] * corners[0] + b[1] * corners[1] + b[2] * corners[2]);
    EXPECT_NEAR(quadratic.at(b), expected, 1e-9 * expected);
}

TEST(TriangleQuadratic, BestPlaceBeatsAGridOverTheTriangle) {
    SeededRandom random(10);
    for (int trial = 0; trial < 200; ++trial) {
        TriangleQuadratic quadratic;
        // From a full triangle to one that is a line or a point.
        Mat3 points = random_matrix(random, 3, 3, 3.0);
        if (trial % 4 == 1) points.col(1) = points.col(0);
        if (trial % 4 == 2) points.col(2) = 0.5 * (points.col(0) + points.col(1));
        if (trial % 40 == 3) points.col(1) = points.col(2) = points.col(0);
        const Vec3 wanted = random_matrix(random, 3, 1, 4.0);
        quadratic.gram = points.transpose() * points;
        quadratic.linear = points.transpose() * wanted;
        const Vec3 best = quadratic.best_place();
        EXPECT_GE(best.minCoeff(), 0.0);
        EXPECT_NEAR(best.sum(), 1.0, 1e-12);
        const double least = quadratic.at(best);
        constexpr int kSteps = 40;
        for (int i = 0; i <= kSteps; ++i) {
            for (int j = 0; i + j <= kSteps; ++j) {
                const Vec3 b(static_cast<double>(i) / kSteps, static_cast<double>(j) / kSteps,
                             static_cast<double>(kSteps - i - j) / kSteps);
                ASSERT_LE(least, quadratic.at(b) + 1e-9) << "trial " << trial;
            }
        }
    }
}

}  // namespace
}  // namespace rig::host
