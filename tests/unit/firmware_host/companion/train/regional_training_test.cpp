#include "firmware_host/companion/train/regional_training.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "core/pipeline/pipeline.hpp"
#include "firmware_host/companion/sample/sample.hpp"
#include "firmware_host/companion/train/pack_writer.hpp"
#include "firmware_host/companion/train/train.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::host {
namespace {

struct Sample {
    Rig rig = sample_rig();
    MarkerLayout layout = sample_layout(rig);
    Take take = sample_take(rig);
};

const Sample& sample() {
    static const Sample one;
    return one;
}

TrainOptions options_of(SolverKind solver) {
    TrainOptions options;
    options.solver = solver;
    options.takes = {sample().take};
    return options;
}

TEST(RegionalTraining, WhatIsTrainedIsWhatIsOpened) {
    for (const SolverKind solver : {SolverKind::kKeyShapes, SolverKind::kExamples}) {
        const auto trained = train(sample().rig, sample().layout, options_of(solver));
        ASSERT_TRUE(trained.has_value()) << trained.error().message;
        const test::TempFolder folder;
        const auto saved = save_pack(folder / "face.pack", trained->view(), {.name = "regions"});
        ASSERT_TRUE(saved.has_value()) << saved.error().message;
        const auto opened = open_pack_file(folder / "face.pack");
        ASSERT_TRUE(opened.has_value()) << opened.error().message;
        ASSERT_EQ(opened->pack().region_count, trained->regions.size());
        for (std::size_t r = 0; r < trained->regions.size(); ++r) {
            EXPECT_EQ(opened->pack().regions[r].name, trained->regions[r].name);
            EXPECT_EQ(opened->pack().regions[r].example_count, trained->regions[r].example_count);
        }
    }
}

TEST(RegionalTraining, ExamplesBeginWithTheNeutralPose) {
    const auto trained = train(sample().rig, sample().layout, options_of(SolverKind::kExamples));
    ASSERT_TRUE(trained.has_value());
    EXPECT_GE(trained->regions.size(), 8U);
    for (const TrainedRegion& region : trained->regions) {
        EXPECT_EQ(region.solver, RegionSolver::kSimplex);
        EXPECT_EQ(region.example_count, 12U);
        const std::size_t n = trained->shape_names.size();
        for (std::size_t i = 0; i < n; ++i) EXPECT_EQ(region.shapes[i], 0.0F);
    }
}

// The performance a pack was made from, played through the pipeline: markers are explained well.
TEST(RegionalTraining, APackSolvesItsOwnPerformance) {
    for (const SolverKind solver : {SolverKind::kKeyShapes, SolverKind::kExamples}) {
        const auto trained = train(sample().rig, sample().layout, options_of(solver));
        ASSERT_TRUE(trained.has_value());
        const SolvePack pack = trained->view();
        const auto pipeline = std::make_unique<Pipeline>();
        PipelineConfig config;
        config.filter = false;
        config.stabilise = false;
        ASSERT_TRUE(pipeline->configure(pack, config));
        auto state = std::make_unique<FaceState>();
        auto report = std::make_unique<FrameReport>();
        double residual = 0.0;
        std::size_t frames = 0;
        for (std::size_t f = 0; f < sample().take.frame_count; f += 5) {
            std::vector<Vec3> positions(pack.marker_count);
            for (std::size_t k = 0; k < pack.marker_count; ++k) {
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    double x = static_cast<double>(pack.neutral_mm[3 * k + axis]);
                    for (std::size_t i = 0; i < pack.shape_count; ++i) {
                        x += static_cast<double>(pack.basis_mm[(3 * k + axis) * pack.shape_count + i]) *
                             static_cast<double>(sample().take.weights[f * pack.shape_count + i]);
                    }
                    positions[k][static_cast<Eigen::Index>(axis)] = x;
                }
            }
            pipeline->step(LabelledFrame{static_cast<std::int64_t>(f) * 16667, positions}, *state, *report);
            ASSERT_TRUE(report->solved);
            EXPECT_TRUE(report->optimal) << f << " kkt " << report->kkt;
            for (std::size_t i = 0; i < pack.shape_count; ++i) {
                ASSERT_GE(state->weights[i], pack.weight_low[i]);
                ASSERT_LE(state->weights[i], pack.weight_high[i]);
            }
            residual += report->residual_rms_mm;
            ++frames;
        }
        EXPECT_LT(residual / static_cast<double>(frames), 1.2);
        EXPECT_GT(residual / static_cast<double>(frames), 0.01);
    }
}

TEST(RegionalTraining, SaysWhatItLacks) {
    TrainOptions none = options_of(SolverKind::kKeyShapes);
    none.takes.clear();
    EXPECT_NE(fault_of_options(none, 0).find("--take"), std::string::npos);
    TrainOptions many = options_of(SolverKind::kExamples);
    many.regional.examples = kMaxRegionShapes + 1;
    const auto refused = train(sample().rig, sample().layout, many);
    ASSERT_FALSE(refused.has_value());
    EXPECT_NE(refused.error().message.find("examples"), std::string::npos);
    TrainOptions zero = options_of(SolverKind::kKeyShapes);
    zero.regional.key_shapes = 0;
    EXPECT_FALSE(train(sample().rig, sample().layout, zero).has_value());
}

}  // namespace
}  // namespace rig::host
