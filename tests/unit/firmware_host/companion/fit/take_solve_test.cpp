#include "firmware_host/companion/fit/take_solve.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "firmware_host/companion/train/train.hpp"
#include "tests/unit/firmware_host/companion/fit/fit_scene.hpp"

namespace rig::host {
namespace {

TrainOptions quiet() {
    TrainOptions options;
    options.noise_mm = 0.05;
    return options;
}

double weight_rms(const test::FitScene& scene, const test::FitSceneOptions& options,
                  const SolvedTake& solved) {
    double sum = 0.0;
    for (std::size_t f = 0; f < options.frames; ++f) {
        for (std::size_t i = 0; i < options.shapes; ++i) {
            const double error =
                solved.weights(static_cast<Eigen::Index>(options.neutral + f), static_cast<Eigen::Index>(i)) -
                static_cast<double>(scene.tiny.take.weights[f * options.shapes + i]);
            sum += error * error;
        }
    }
    return std::sqrt(sum / static_cast<double>(options.frames * options.shapes));
}

TEST(TakeSolve, FindsTheWeightsBehindATake) {
    const test::FitSceneOptions options;
    const test::FitScene scene = test::fit_scene(options);
    const auto pack = train(scene.tiny.rig, scene.tiny.layout, quiet());
    ASSERT_TRUE(pack);
    double last = -1.0;
    const SolvedTake solved = solve_take(pack->view(), scene.take, false, [&](double share) {
        EXPECT_GT(share, last);
        last = share;
    });
    EXPECT_LT(weight_rms(scene, options, solved), 0.02);
    EXPECT_GT(last, 0.5);
    for (std::size_t f = 0; f < scene.take.frame_count; ++f) {
        EXPECT_TRUE(solved.solved[f]);
        EXPECT_EQ(solved.headset_from_face[f].rotation, Mat3::Identity());
    }
}

TEST(TakeSolve, TakesTheHeadsMotionOut) {
    test::FitSceneOptions options;
    options.slip_mm = 3.0;
    const test::FitScene scene = test::fit_scene(options);
    const auto pack = train(scene.tiny.rig, scene.tiny.layout, quiet());
    ASSERT_TRUE(pack);
    const double with = weight_rms(scene, options, solve_take(pack->view(), scene.take, true));
    const double without = weight_rms(scene, options, solve_take(pack->view(), scene.take, false));
    EXPECT_LT(with, 0.05);
    EXPECT_GT(without, 2.0 * with);
}

TEST(TakeSolve, SaysWhichFramesCountForNothing) {
    test::FitScene scene = test::fit_scene({});
    for (std::size_t k = 0; k < scene.take.marker_count; ++k) {
        scene.take.positions_mm[7 * scene.take.marker_count + k] =
            Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
    }
    const auto pack = train(scene.tiny.rig, scene.tiny.layout, {});
    const SolvedTake solved = solve_take(pack->view(), scene.take, false);
    EXPECT_TRUE(solved.solved[6]);
    EXPECT_FALSE(solved.solved[7]);
    EXPECT_TRUE(solved.solved[8]);
}

}  // namespace
}  // namespace rig::host
