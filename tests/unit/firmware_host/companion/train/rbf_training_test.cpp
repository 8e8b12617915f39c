#include "firmware_host/companion/train/rbf_training.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/solve/rbf.hpp"
#include "firmware_host/companion/train/train.hpp"
#include "tests/support/pack_samples/tiny_rig.hpp"
#include "tests/support/random.hpp"
#include "tests/support/shared_data.hpp"

namespace rig::host {
namespace {

using test::tiny_rig;
using test::TinyRig;

Result<TrainedPack, FileError> train_tiny(const TinyRig& tiny, const RbfTrainingOptions& options = {}) {
    TrainOptions all;
    all.solver = SolverKind::kRbf;
    all.takes = {tiny.take};
    all.rbf = options;
    return train(tiny.rig, tiny.layout, all);
}

// Root mean square error of core's evaluation over all frames and weights, markers with the noise of 0.1 mm
// that training assumes, but not the same noise.
double core_rms(const SolvePack& pack, const Take& take) {
    test::SeededRandom random(31);
    const auto tables = std::make_unique<RbfTables>();
    build_rbf_tables(pack, *tables);
    RbfWorkspace workspace;
    std::vector<float> weights(pack.shape_count);
    std::vector<float> t(pack.neutral_mm.size());
    double sum = 0.0;
    for (std::size_t f = 0; f < take.frame_count; ++f) {
        const float* truth = &take.weights[f * pack.shape_count];
        for (std::size_t r = 0; r < t.size(); ++r) {
            t[r] = pack.neutral_mm[r] + static_cast<float>(random.normal(0.0, 0.1));
            for (std::size_t i = 0; i < pack.shape_count; ++i)
                t[r] += pack.basis_mm[r * pack.shape_count + i] * truth[i];
        }
        static_cast<void>(evaluate_rbf(*tables, t, workspace, weights));
        for (std::size_t i = 0; i < weights.size(); ++i) {
            const double error = static_cast<double>(weights[i] - truth[i]);
            sum += error * error;
        }
    }
    return std::sqrt(sum / static_cast<double>(take.weights.size()));
}

TEST(TrainRbf, LearnsATakeAndCoreEvaluatesTheSame) {
    const TinyRig tiny = tiny_rig(24, 4, 600);
    const auto pack = train_tiny(tiny, {.centres = 60});
    ASSERT_TRUE(pack.has_value()) << pack.error().message;
    const RbfTrainingReport& report = *pack->report.rbf;
    EXPECT_EQ(report.frames, 600U);
    EXPECT_GE(report.dimensions, 3U);
    EXPECT_LE(report.centres, 60U);
    EXPECT_GE(report.centres, 50U);
    EXPECT_GT(report.variance_kept, 0.95);
    // The weights' own spread about their means is 0.38: the model explains nearly all of it.
    EXPECT_LT(report.in_take_rms, 0.1);
    EXPECT_GT(report.in_take_rms, 0.001);
    EXPECT_LT(report.in_take_rms, report.cross_validated_rms);
    EXPECT_NEAR(core_rms(pack->view(), tiny.take), report.in_take_rms, 0.1 * report.in_take_rms);
}

TEST(TrainRbf, EveryKernelLearnsATakeAndCoreEvaluatesTheSame) {
    const TinyRig tiny = tiny_rig(24, 4, 600);
    for (const RbfKernel kernel : {RbfKernel::kThinPlate, RbfKernel::kMultiquadric}) {
        const auto pack = train_tiny(tiny, {.centres = 60, .kernel = kernel});
        ASSERT_TRUE(pack.has_value()) << pack.error().message;
        EXPECT_EQ(pack->rbf.kernel, kernel);
        const RbfTrainingReport& report = *pack->report.rbf;
        EXPECT_LT(report.in_take_rms, 0.1) << rbf_kernel_name(kernel);
        EXPECT_GT(report.in_take_rms, 0.001);
        EXPECT_NEAR(core_rms(pack->view(), tiny.take), report.in_take_rms, 0.1 * report.in_take_rms)
            << rbf_kernel_name(kernel);
    }
}

TEST(TrainRbf, KeepsWhatItTriedAndHowLambdaWasFound) {
    const TinyRig tiny = tiny_rig(24, 4, 600);
    const auto pack = train_tiny(tiny, {.centres = 60});
    ASSERT_TRUE(pack.has_value()) << pack.error().message;
    const RbfTrainingReport& report = *pack->report.rbf;
    double best = 1e9;
    for (const CrossValidation& tried : report.cross_validation) best = std::min(best, tried.weight_rms);
    EXPECT_GE(report.cross_validation.size(), 14U + 3U) << "widths twice and at least three dimensions";
    EXPECT_DOUBLE_EQ(best, report.cross_validated_rms);
    EXPECT_GT(report.distance_p50, 0.0);
    EXPECT_LT(report.distance_p50, report.distance_p95);
    EXPECT_LT(report.distance_p95, 2.0) << "references are taken from the take";
    ASSERT_EQ(report.gcv_paths.size(), 4U);
    for (const GcvPath& path : report.gcv_paths) {
        ASSERT_GE(path.size(), 1U);
        EXPECT_LE(path.back().gcv, path.front().gcv);
        EXPECT_GT(path.back().lambda, 0.0);
    }
    double kept = 0.0;
    for (std::size_t a = 0; a < report.dimensions; ++a) kept += report.variance_shares[a];
    EXPECT_DOUBLE_EQ(kept, report.variance_kept);
}

TEST(TrainRbf, AFallbackBringsTheBoxQpsNumbers) {
    const TinyRig tiny = tiny_rig(20, 3, 400);
    const auto plain = train_tiny(tiny, {.centres = 20});
    const auto falling = train_tiny(tiny, {.centres = 20, .hull_near_widths = 1.5, .hull_far_widths = 3.0});
    ASSERT_TRUE(plain.has_value() && falling.has_value());
    EXPECT_EQ(plain->ridge_mm2, 0.0);
    EXPECT_EQ(plain->view().rbf.hull_far_widths, 0.0F);
    EXPECT_GT(falling->ridge_mm2, 0.0);
    EXPECT_GT(falling->sparsity_mm2, 0.0);
    EXPECT_GT(falling->temporal_gamma[0], 0.0F);
    EXPECT_EQ(falling->view().rbf.hull_near_widths, 1.5F);
    EXPECT_EQ(falling->view().rbf.hull_far_widths, 3.0F);
    for (const auto& [near, far] : {std::pair{3.0, 1.5}, std::pair{-1.0, 2.0}, std::pair{2.0, 2.0},
                                    std::pair{0.0, 1e4}, std::pair{0.0, std::nan("")}}) {
        EXPECT_FALSE(
            train_tiny(tiny, {.centres = 20, .hull_near_widths = near, .hull_far_widths = far}).has_value())
            << near << " " << far;
    }
}

TEST(TrainRbf, IsDeterministic) {
    const TinyRig tiny = tiny_rig(20, 3, 400);
    const auto a = train_tiny(tiny, {.centres = 20});
    const auto b = train_tiny(tiny, {.centres = 20});
    ASSERT_TRUE(a.has_value() && b.has_value());
    EXPECT_EQ(a->rbf.weights, b->rbf.weights);
    EXPECT_EQ(a->rbf.centres, b->rbf.centres);
    EXPECT_EQ(a->rbf.widths_mm, b->rbf.widths_mm);
}

TEST(TrainRbf, KeepsTheDimensionsItIsTold) {
    const TinyRig tiny = tiny_rig(20, 5, 400);
    const auto pack = train_tiny(tiny, {.centres = 30, .dimensions = 2});
    ASSERT_TRUE(pack.has_value()) << pack.error().message;
    EXPECT_EQ(pack->rbf.dimension_count, 2);
}

TEST(TrainRbf, NeverKeepsMoreDimensionsThanMove) {
    const TinyRig tiny = tiny_rig(20, 3, 400);
    const auto pack = train_tiny(tiny, {.centres = 30, .dimensions = 32});
    ASSERT_TRUE(pack.has_value()) << pack.error().message;
    EXPECT_LE(pack->rbf.dimension_count, 3);
}

TEST(TrainRbf, SaysWhatIsMissing) {
    const auto fault = [](const Result<TrainedPack, FileError>& pack) {
        return pack ? "" : pack.error().message;
    };
    TinyRig tiny = tiny_rig(20, 3, 39);
    EXPECT_NE(fault(train_tiny(tiny)).find("39 frames"), std::string::npos);
    tiny = tiny_rig(20, 3, 100);
    std::ranges::fill(tiny.take.weights, 0.5F);
    EXPECT_NE(fault(train_tiny(tiny)).find("less than their noise"), std::string::npos);
    tiny = tiny_rig(20, 3, 100);
    EXPECT_NE(fault(train_tiny(tiny, {.centres = 1})).find("2 to 256"), std::string::npos);
    EXPECT_NE(fault(train_tiny(tiny, {.centres = 257})).find("2 to 256"), std::string::npos);
    TrainOptions no_take;
    no_take.solver = SolverKind::kRbf;
    EXPECT_NE(fault(train(tiny.rig, tiny.layout, no_take)).find("--take"), std::string::npos);
}

TEST(TrainRbf, RepeatsThePublishedTrialOnTheRecordedTake) {
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "minutes of arithmetic under the sanitizers; the tests above run the same code there";
#endif
    RIG_SHARED_DATA_OR_SKIP(path, "rig");
    const auto rig = load_rig(path);
    ASSERT_TRUE(rig.has_value()) << rig.error().message;
    const auto layout = load_layout(path, "60", *rig);
    ASSERT_TRUE(layout.has_value()) << layout.error().message;
    auto take = load_take(path.parent_path() / "takes/alex_rom_3_weights60.csv", *rig);
    ASSERT_TRUE(take.has_value()) << take.error().message;
    TrainOptions options;
    options.solver = SolverKind::kRbf;
    options.takes = {std::move(*take)};
    options.rbf.dimensions = 4;
    const auto four = train(*rig, *layout, options);
    ASSERT_TRUE(four.has_value()) << four.error().message;
    options.rbf.dimensions = 20;
    const auto twenty = train(*rig, *layout, options);
    ASSERT_TRUE(twenty.has_value()) << twenty.error().message;
    // Orientation from an independent trial: 0.042 with 4 components, 0.021 with 20.
    EXPECT_GT(four->report.rbf->visible_in_take_rms, 0.025);
    EXPECT_LT(four->report.rbf->visible_in_take_rms, 0.042);
    EXPECT_GT(twenty->report.rbf->visible_in_take_rms, 0.015);
    EXPECT_LT(twenty->report.rbf->visible_in_take_rms, 0.028);
}

}  // namespace
}  // namespace rig::host
