#include "firmware_host/companion/train/marker_set_training.hpp"

#include <gtest/gtest.h>

#include <cmath>

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
    MarkerModel model = marker_model(rig, layout);
    Take take = sample_take(rig);
};

const Sample& sample() {
    static const Sample one;
    return one;
}

Eigen::MatrixXd basis_of(const MarkerSet& set) {
    const std::size_t n = sample().rig.shapes.size();
    Eigen::MatrixXd out(static_cast<Eigen::Index>(3 * set.markers.size()), static_cast<Eigen::Index>(n));
    for (Eigen::Index r = 0; r < out.rows(); ++r) {
        for (Eigen::Index i = 0; i < out.cols(); ++i) {
            const auto row = static_cast<std::size_t>(r);
            out(r, i) = static_cast<double>(
                sample()
                    .model.basis_mm[(3U * set.markers[row / 3] + row % 3) * n + static_cast<std::size_t>(i)]);
        }
    }
    return out;
}

// Modes, their variances and what they leave make up the covariance's diagonal; modes are its eigenvectors.
TEST(MarkerSetTraining, IsThePrincipalComponentsOfEverySet) {
    const std::vector<MarkerSet> plan = marker_sets(sample().layout);
    const ExpressionSpread spread = spread_of_takes({&sample().take, 1}, sample().rig.shapes.size());
    const auto sets = train_marker_sets(plan, sample().model.basis_mm, spread);
    ASSERT_EQ(sets.size(), plan.size());
    for (std::size_t f = 0; f < sets.size(); ++f) {
        SCOPED_TRACE(sets[f].name);
        const Eigen::MatrixXd basis = basis_of(plan[f]);
        const Eigen::MatrixXd covariance = basis * spread.covariance * basis.transpose();
        const Eigen::Index rows = covariance.rows();
        EXPECT_GE(sets[f].mode_count, 5U) << "the source keeps 5 to 10";
        EXPECT_LE(sets[f].mode_count, f == 0 ? kMaxModes : 10U);
        Eigen::VectorXd left = covariance.diagonal();
        for (std::size_t j = 0; j < sets[f].mode_count; ++j) {
            Eigen::VectorXd mode(rows);
            for (Eigen::Index r = 0; r < rows; ++r)
                mode[r] = static_cast<double>(
                    sets[f].modes[j * static_cast<std::size_t>(rows) + static_cast<std::size_t>(r)]);
            const auto variance = static_cast<double>(sets[f].variance_mm2[j]);
            EXPECT_NEAR(mode.norm(), 1.0, 1e-5);
            EXPECT_LT((covariance * mode - variance * mode).norm(), 1e-4 * covariance.norm());
            left -= variance * mode.cwiseAbs2();
        }
        for (Eigen::Index k = 0; k < rows / 3; ++k) {
            EXPECT_NEAR(static_cast<double>(sets[f].residual_mm2[static_cast<std::size_t>(k)]),
                        left.segment(3 * k, 3).mean(), 1e-4 * covariance.diagonal().maxCoeff());
        }
        const Eigen::VectorXd mean = basis * spread.mean;
        for (Eigen::Index r = 0; r < rows; ++r)
            EXPECT_NEAR(static_cast<double>(sets[f].mean_mm[static_cast<std::size_t>(r)]), mean[r], 1e-4);
    }
}

TEST(MarkerSetTraining, KeepsFewerModesOnlyWhereTheExpressionsHaveNoMoreRank) {
    const std::vector<MarkerSet> plan = marker_sets(sample().layout);
    Eigen::MatrixXd three = Eigen::MatrixXd::Zero(3, static_cast<Eigen::Index>(sample().rig.shapes.size()));
    for (Eigen::Index i = 0; i < 3; ++i) three(i, 4 * i) = 1.0;
    const auto sets = train_marker_sets(plan, sample().model.basis_mm, spread_of_expressions(three));
    EXPECT_EQ(sets[0].mode_count, 2U) << "three expressions about their mean";
    for (const TrainedMarkerSet& set : sets) {
        EXPECT_GE(set.mode_count, 1U) << set.name;
        EXPECT_LE(set.mode_count, 2U) << set.name;
        for (const float variance : set.variance_mm2) EXPECT_GT(variance, 0.0F) << set.name;
    }
}

TEST(ExpressionSpreads, MixTheTakesWithAnyFaceOfTheRig) {
    const std::size_t n = sample().rig.shapes.size();
    const ExpressionSpread rig = spread_of_rig(n);
    const ExpressionSpread none = spread_of_takes({}, n);
    EXPECT_EQ(none.mean, rig.mean);
    EXPECT_EQ(none.covariance, rig.covariance);
    // A take of one frame over and over spreads by the rig's share alone.
    Take still;
    still.shape_names.resize(n);
    still.frame_count = 5;
    still.weights.assign(5 * n, 0.4F);
    const ExpressionSpread mixed = spread_of_takes({&still, 1}, n);
    for (Eigen::Index i = 0; i < mixed.mean.size(); ++i) {
        EXPECT_NEAR(mixed.mean[i], (1.0 - kRigShare) * 0.4 + kRigShare * rig.mean[i], 1e-6);
        const double apart = 0.4 - rig.mean[i];
        EXPECT_NEAR(mixed.covariance(i, i),
                    kRigShare * rig.covariance(i, i) + kRigShare * (1.0 - kRigShare) * apart * apart, 1e-6);
    }
}

TEST(MarkerSetTraining, WhatIsTrainedIsWhatIsOpened) {
    TrainOptions options;
    const auto trained = train(sample().rig, sample().layout, options);
    ASSERT_TRUE(trained.has_value()) << trained.error().message;
    ASSERT_EQ(trained->marker_sets.size(), 21U);
    const test::TempFolder folder;
    const auto saved = save_pack(folder / "face.pack", trained->view(), {.name = "sets"});
    ASSERT_TRUE(saved.has_value()) << saved.error().message;
    const auto opened = open_pack_file(folder / "face.pack");
    ASSERT_TRUE(opened.has_value()) << opened.error().message;
    ASSERT_EQ(opened->pack().marker_set_count, 21);
    for (std::size_t f = 0; f < 21; ++f) {
        EXPECT_EQ(opened->pack().marker_sets[f].name, trained->marker_sets[f].name);
        EXPECT_EQ(opened->pack().marker_sets[f].mode_count, trained->marker_sets[f].mode_count);
    }
    options.marker_sets = false;
    const auto plain = train(sample().rig, sample().layout, options);
    ASSERT_TRUE(plain.has_value());
    EXPECT_EQ(plain->view().marker_set_count, 0);
}

}  // namespace
}  // namespace rig::host
