#include "firmware_host/companion/fit/similarity.hpp"

#include <gtest/gtest.h>

namespace rig::host {
namespace {

TEST(Similarity, FindsAnExactOne) {
    Similarity truth;
    truth.scale = 1.3;
    truth.rotation = Eigen::AngleAxisd(2.9, Vec3(1.0, -2.0, 0.5).normalized()).toRotationMatrix();
    truth.translation_mm = {400.0, -30.0, 7.0};
    SimilarityFit fit;
    for (const Vec3& x : {Vec3(1000, 0, 0), Vec3(1010, 4, 0), Vec3(1000, 9, 3), Vec3(990, -5, 8)})
        fit.add(x, truth.apply(x));
    const auto found = fit.solve(true);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->scale, 1.3, 1e-12);
    EXPECT_LT((found->rotation - truth.rotation).norm(), 1e-12);
    EXPECT_LT((found->translation_mm - truth.translation_mm).norm(), 1e-9);
}

TEST(Similarity, KeepsTheScaleWhenAsked) {
    SimilarityFit fit;
    for (const Vec3& x : {Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 2, 0), Vec3(0, -2, 0)}) fit.add(x, 3.0 * x);
    const auto found = fit.solve(false);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->scale, 1.0);
    EXPECT_LT((found->rotation - Mat3::Identity()).norm(), 1e-12);
    EXPECT_NEAR(fit.solve(true)->scale, 3.0, 1e-12);
}

TEST(Similarity, AnswersAMirrorWithATurn) {
    SimilarityFit fit;
    for (const Vec3& x : {Vec3(5, 0, 0), Vec3(0, 4, 0), Vec3(0, 0, 3), Vec3(1, 1, 1)})
        fit.add(x, {-x[0], x[1], x[2]});
    const auto found = fit.solve(true);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->rotation.determinant(), 1.0, 1e-12);
}

TEST(Similarity, RefusesPointsThatLeaveATurnOpen) {
    SimilarityFit two;
    two.add({0, 0, 0}, {0, 0, 0});
    two.add({1, 0, 0}, {1, 0, 0});
    EXPECT_FALSE(two.solve(true));
    SimilarityFit line;
    for (double s = 0.0; s < 5.0; s += 1.0) line.add({s, 2.0 * s, -s}, {s, 2.0 * s, -s});
    EXPECT_FALSE(line.solve(true));
    SimilarityFit one_point;
    for (int i = 0; i < 5; ++i) one_point.add({1, 2, 3}, {4, 5, 6});
    EXPECT_FALSE(one_point.solve(true));
}

TEST(Similarity, ComposesInOrder) {
    const Similarity inner{2.0, Eigen::AngleAxisd(0.3, Vec3::UnitX()).toRotationMatrix(), {1, 2, 3}};
    const Similarity outer{0.5, Eigen::AngleAxisd(-1.1, Vec3::UnitZ()).toRotationMatrix(), {-4, 0, 9}};
    const Vec3 x(7.0, -1.0, 2.0);
    EXPECT_LT((compose(outer, inner).apply(x) - outer.apply(inner.apply(x))).norm(), 1e-12);
}

}  // namespace
}  // namespace rig::host
