#include "firmware_host/companion/experiments/rbf_regression.hpp"

#include <gtest/gtest.h>

#include "tests/support/pack_samples/tiny_rig.hpp"

namespace rig::host {
namespace {

TEST(RbfRegression, ScoresItsOwnTakeAsTrainingDoes) {
    const test::TinyRig tiny = test::tiny_rig(24, 4, 600);
    const MarkerModel model = marker_model(tiny.rig, tiny.layout);
    auto rbf = RbfRegression::learn(model, tiny.take, 0.1, {.centres = 60});
    ASSERT_TRUE(rbf.has_value()) << rbf.error().message;
    const TakeScore own = score(*rbf, model, tiny.take, 0.1, 1);
    EXPECT_NEAR(own.weight_rms, rbf->report().visible_in_take_rms, 0.1 * own.weight_rms);
    EXPECT_LE(own.distance_p50, own.distance_p95);
    EXPECT_LT(own.distance_p95, 2.0) << "its own references are near";
    test::TinyRig far = test::tiny_rig(24, 4, 600);
    for (float& w : far.take.weights) w = 4.0F;
    EXPECT_GT(score(*rbf, model, far.take, 0.1, 10).distance_p50, own.distance_p95);
}

TEST(RbfRegression, SaysWhyItCannotLearn) {
    const test::TinyRig tiny = test::tiny_rig(24, 4, 10);
    const auto rbf = RbfRegression::learn(marker_model(tiny.rig, tiny.layout), tiny.take, 0.1, {});
    ASSERT_FALSE(rbf.has_value());
    EXPECT_NE(rbf.error().message.find("10 frames"), std::string::npos);
}

}  // namespace
}  // namespace rig::host
