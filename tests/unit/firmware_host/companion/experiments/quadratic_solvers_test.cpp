#include "firmware_host/companion/experiments/quadratic_solvers.hpp"

#include <gtest/gtest.h>

#include "tests/support/pack_samples/tiny_rig.hpp"

namespace rig::host {
namespace {

RecordedHead tiny_head() {
    test::TinyRig tiny = test::tiny_rig(24, 4, 120);
    RecordedHead head;
    head.model = marker_model(tiny.rig, tiny.layout);
    head.rig = std::move(tiny.rig);
    head.layout = std::move(tiny.layout);
    head.range_of_motion = tiny.take;
    head.speech = std::move(tiny.take);
    return head;
}

TEST(EquationSolving, GivesCleanWeightsBackAndKnowsNoBounds) {
    const RecordedHead head = tiny_head();
    const EquationSolving equations(head.model);
    const std::vector<float> w = equations.solve(marker_frame(head.model, head.range_of_motion, 40, 0.0, 1));
    const std::span<const float> truth = frame_weights(head.range_of_motion, 40);
    for (std::size_t i = 0; i < w.size(); ++i) EXPECT_NEAR(w[i], truth[i], 1e-4F);
    std::vector<float> beyond = head.model.neutral_mm;
    for (std::size_t r = 0; r < beyond.size(); ++r)
        beyond[r] += 2.0F * head.model.basis_mm[r * 4] - head.model.basis_mm[r * 4 + 1];
    const std::vector<float> free = equations.solve(beyond);
    EXPECT_NEAR(free[0], 2.0F, 1e-3F);
    EXPECT_NEAR(free[1], -1.0F, 1e-3F);
    const std::vector<float> inside = clamped(free);
    EXPECT_EQ(inside[0], 1.0F);
    EXPECT_EQ(inside[1], 0.0F);
}

TEST(BoxQpPipeline, FollowsATakeAndStartsAnew) {
    const RecordedHead head = tiny_head();
    auto box = BoxQpPipeline::learn(head, false);
    ASSERT_TRUE(box.has_value()) << box.error().message;
    for (int round = 0; round < 2; ++round) {
        WeightError error(head.model);
        for (std::size_t f = 0; f < 120; ++f) {
            const std::span<const float> w =
                box->solve(marker_frame(head.model, head.range_of_motion, f, 0.05, 3));
            if (f >= 30) error.add(w, frame_weights(head.range_of_motion, f));
        }
        EXPECT_LT(error.rms(), 0.05) << round;
        EXPECT_GT(error.rms(), 0.0005);
        box->restart();
    }
}

}  // namespace
}  // namespace rig::host
