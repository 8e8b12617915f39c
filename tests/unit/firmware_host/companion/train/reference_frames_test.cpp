#include "firmware_host/companion/train/reference_frames.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/random.hpp"

namespace rig::host {
namespace {

using Eigen::Index;

// `clusters` far-apart clouds of `each` points around (100 c, 0).
Eigen::MatrixXd clouds(Index clusters, Index each) {
    test::SeededRandom random(21);
    Eigen::MatrixXd points(clusters * each, 2);
    for (Index r = 0; r < points.rows(); ++r) {
        points(r, 0) = 100.0 * static_cast<double>(r / each) + random.normal(0.0, 1.0);
        points(r, 1) = random.normal(0.0, 1.0);
    }
    return points;
}

TEST(ChooseReferenceFrames, TakesTheMiddleOfEveryCloud) {
    const Eigen::MatrixXd points = clouds(7, 50);
    const std::vector<Index> chosen = choose_reference_frames(points, 7);
    ASSERT_EQ(chosen.size(), 7U);
    for (std::size_t c = 0; c < 7; ++c) {
        EXPECT_EQ(chosen[c] / 50, static_cast<Index>(c));
        EXPECT_LT((points.row(chosen[c]) - Eigen::RowVector2d(100.0 * static_cast<double>(c), 0.0)).norm(),
                  1.0);
    }
}

TEST(ChooseReferenceFrames, IsSortedUniqueAndInside) {
    for (const std::size_t count : {1UL, 2UL, 40UL}) {
        const Eigen::MatrixXd points = clouds(3, 50);
        const std::vector<Index> chosen = choose_reference_frames(points, count);
        EXPECT_GE(chosen.size(), 1U);
        EXPECT_LE(chosen.size(), count);
        EXPECT_TRUE(std::ranges::is_sorted(chosen, std::less_equal<>()) || chosen.size() == 1);
        EXPECT_GE(chosen.front(), 0);
        EXPECT_LT(chosen.back(), points.rows());
    }
}

TEST(ChooseReferenceFrames, FewerWhenFramesRepeat) {
    Eigen::MatrixXd points = Eigen::MatrixXd::Zero(50, 3);
    EXPECT_EQ(choose_reference_frames(points, 10).size(), 1U);
    points.row(20).setConstant(5.0);
    EXPECT_EQ(choose_reference_frames(points, 10).size(), 2U);
}

TEST(ChooseReferenceFrames, LongTakesAreThinnedAndIndicesStayRight) {
    Eigen::MatrixXd points = Eigen::MatrixXd::Zero(10000, 1);
    for (Index r = 0; r < points.rows(); ++r) points(r, 0) = r < 5000 ? 0.0 : 10.0;
    const std::vector<Index> chosen = choose_reference_frames(points, 2);
    ASSERT_EQ(chosen.size(), 2U);
    EXPECT_EQ(points(chosen[0], 0), 0.0);
    EXPECT_EQ(points(chosen[1], 0), 10.0);
}

}  // namespace
}  // namespace rig::host
