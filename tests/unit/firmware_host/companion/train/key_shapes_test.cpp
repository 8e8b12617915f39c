#include "firmware_host/companion/train/key_shapes.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>

#include "core/limits.hpp"
#include "tests/support/pack_samples/tiny_rig.hpp"
#include "tests/support/random.hpp"

namespace rig::host {
namespace {

constexpr std::array<std::size_t, 3> kAxes{0, 1, 2};

RegionMotion tiny_motion() {
    const test::TinyRig tiny = test::tiny_rig(12, 4, 300);
    const MarkerModel model = marker_model(tiny.rig, tiny.layout);
    const std::vector<Take> takes{tiny.take};
    return region_motion(whole_face(tiny.layout)[0], model.neutral_mm, model.basis_mm, takes, kAxes);
}

TEST(KeyShapes, MotionIsAboutTheNeutralCentroid) {
    const RegionMotion motion = tiny_motion();
    const test::TinyRig tiny = test::tiny_rig(12, 4, 300);
    const MarkerModel model = marker_model(tiny.rig, tiny.layout);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        double centroid = 0.0;
        double moved = 0.0;  // sum over markers at frame 7
        double still = 0.0;
        for (std::size_t k = 0; k < 12; ++k) {
            centroid += static_cast<double>(model.neutral_mm[3 * k + axis]) / 12.0;
            double x = static_cast<double>(model.neutral_mm[3 * k + axis]);
            for (std::size_t i = 0; i < 4; ++i) {
                x += static_cast<double>(model.basis_mm[(3 * k + axis) * 4 + i]) *
                     static_cast<double>(tiny.take.weights[7 * 4 + i]);
            }
            moved += motion.positions_mm(7, static_cast<Eigen::Index>(3 * k + axis));
            still += x;
        }
        EXPECT_NEAR(moved, still - 12.0 * centroid, 1e-9);
    }
}

TEST(KeyShapes, SpreadIsNestedAndItsErrorFalls) {
    const RegionMotion motion = tiny_motion();
    double before = HUGE_VAL;
    std::set<Eigen::Index> smaller;
    for (std::size_t count = 2; count <= 12; count += 2) {
        const KeyShapes shapes = choose_key_shapes(motion, KeyShapeMethod::kSpread, count);
        EXPECT_EQ(shapes.frames.size(), count);
        const std::set<Eigen::Index> now(shapes.frames.begin(), shapes.frames.end());
        EXPECT_EQ(now.size(), count);  // no frame twice
        for (const Eigen::Index f : smaller) EXPECT_TRUE(now.contains(f));
        const KeyShapeError error = key_shape_error(motion.positions_mm, shapes);
        EXPECT_LE(error.sum_mm2, before * (1.0 + 1e-9)) << count;
        before = error.sum_mm2;
        smaller = now;
    }
    EXPECT_LT(before, 1e-3 * motion.positions_mm.squaredNorm());
}

TEST(KeyShapes, ClustersAreMeansOfFramesThatAreAlike) {
    // Three bunches of frames in the plane.
    test::SeededRandom random(1);
    RegionMotion motion;
    motion.positions_mm.resize(90, 6);
    motion.weights = Eigen::MatrixXd::Zero(90, 1);
    for (Eigen::Index f = 0; f < 90; ++f) {
        for (Eigen::Index c = 0; c < 6; ++c)
            motion.positions_mm(f, c) = random.normal(0.0, 0.1) + (f % 3 == 1 && c == 0 ? 20.0 : 0.0) +
                                        (f % 3 == 2 && c == 1 ? 20.0 : 0.0);
        motion.weights(f, 0) = static_cast<double>(f % 3);
    }
    for (const KeyShapeMethod method : {KeyShapeMethod::kClusters2, KeyShapeMethod::kClusters3}) {
        const KeyShapes shapes = choose_key_shapes(motion, method, 3);
        ASSERT_EQ(shapes.frames.size(), 3U);
        std::set<int> seen;
        for (Eigen::Index k = 0; k < 3; ++k) {
            const double bunch = shapes.weights(k, 0);  // a mean of equal numbers
            EXPECT_EQ(bunch, std::round(bunch));
            seen.insert(static_cast<int>(bunch));
            EXPECT_NEAR(shapes.positions_mm(k, 0), bunch == 1.0 ? 20.0 : 0.0, 0.1);
        }
        EXPECT_EQ(seen.size(), 3U);
    }
}

TEST(KeyShapes, TheHullHoldsEveryFrame) {
    test::SeededRandom random(2);
    RegionMotion motion;
    motion.positions_mm.resize(400, 2);
    motion.weights = Eigen::MatrixXd::Zero(400, 1);
    for (Eigen::Index f = 0; f < 400; ++f) {
        motion.positions_mm(f, 0) = random.uniform(-3.0, 3.0);
        motion.positions_mm(f, 1) = random.uniform(-1.0, 1.0);
    }
    const KeyShapes shapes = choose_key_shapes(motion, KeyShapeMethod::kHull, 0);
    ASSERT_GE(shapes.frames.size(), 4U);
    ASSERT_LE(shapes.frames.size(), kMaxRegionShapes);
    // Corners go round one way; every point is on the inner side of every edge.
    double sign = 0.0;
    const auto corner = [&](std::size_t i) {
        return Eigen::Vector2d(shapes.positions_mm.row(static_cast<Eigen::Index>(i % shapes.frames.size())));
    };
    for (std::size_t i = 0; i < shapes.frames.size(); ++i) {
        const Eigen::Vector2d edge = corner(i + 1) - corner(i);
        for (Eigen::Index f = 0; f < 400; ++f) {
            const Eigen::Vector2d to = motion.positions_mm.row(f).transpose() - corner(i);
            const double side = edge[0] * to[1] - edge[1] * to[0];
            if (std::fabs(side) < 1e-9) continue;
            if (sign == 0.0) sign = side > 0.0 ? 1.0 : -1.0;
            ASSERT_GT(side * sign, 0.0);
        }
    }
    EXPECT_EQ(choose_key_shapes(motion, KeyShapeMethod::kHull, 5).frames.size(), 5U);
}

TEST(KeyShapes, EqualFramesAndSmallTakesAreTaken) {
    RegionMotion motion;
    motion.positions_mm = Eigen::MatrixXd::Constant(10, 6, 2.0);
    motion.weights = Eigen::MatrixXd::Constant(10, 2, 0.5);
    for (const KeyShapeMethod method : {KeyShapeMethod::kSpread, KeyShapeMethod::kClusters2,
                                        KeyShapeMethod::kClusters3, KeyShapeMethod::kHull}) {
        const KeyShapes shapes = choose_key_shapes(motion, method, 12);
        ASSERT_GE(shapes.frames.size(), 1U);
        ASSERT_LE(shapes.frames.size(), 12U);
        const KeyShapeError error = key_shape_error(motion.positions_mm, shapes);
        EXPECT_LT(error.rms_mm, 1e-4);
    }
}

TEST(KeyShapes, MethodsHaveNames) {
    for (const KeyShapeMethod method : {KeyShapeMethod::kSpread, KeyShapeMethod::kClusters2,
                                        KeyShapeMethod::kClusters3, KeyShapeMethod::kHull})
        EXPECT_EQ(key_shape_method(key_shape_method_name(method)), method);
    EXPECT_EQ(key_shape_method("clusters"), KeyShapeMethod::kClusters3);
    EXPECT_FALSE(key_shape_method("best").has_value());
}

}  // namespace
}  // namespace rig::host
