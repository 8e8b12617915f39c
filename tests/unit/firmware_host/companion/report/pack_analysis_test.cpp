#include "firmware_host/companion/report/pack_analysis.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "firmware_host/companion/train/train.hpp"
#include "tests/support/pack_samples/tiny_rig.hpp"

namespace rig::host {
namespace {

// Eight markers of which shape i moves marker i alone, along x, by lengths_mm[i].
struct PlainPack {
    std::vector<float> neutral, basis, low, high, mean, sigma, gamma;
    SolvePack pack;

    explicit PlainPack(const std::vector<float>& lengths_mm) {
        const std::size_t n = lengths_mm.size();
        for (int k = 0; k < 8; ++k)
            neutral.insert(neutral.end(),
                           {10.0F * static_cast<float>(k % 3 - 1), -14.0F * static_cast<float>(k), 0.0F});
        basis.assign(24 * n, 0.0F);
        for (std::size_t i = 0; i < n; ++i) basis[3 * i * n + i] = lengths_mm[i];
        low.assign(n, 0.0F);
        high.assign(n, 1.0F);
        mean.assign(n, 0.1F);
        sigma.assign(n, 0.3F);
        gamma.assign(n, 0.0F);
        pack.marker_count = 8;
        pack.shape_count = static_cast<std::uint16_t>(n);
        pack.neutral_mm = neutral;
        pack.basis_mm = basis;
        pack.weight_low = low;
        pack.weight_high = high;
        pack.prior_mean = mean;
        pack.prior_sigma = sigma;
        pack.temporal_gamma = gamma;
        pack.noise_mm = 0.5F;
    }
};

TEST(AnalysePack, MatchesTheFormulaWhereShapesDoNotMeet) {
    const std::vector<float> lengths{4.0F, 1.0F, 0.25F, 0.0F};
    const PlainPack plain(lengths);
    const auto analysis = analyse_pack(plain.pack, nullptr);
    ASSERT_TRUE(analysis);
    for (std::size_t i = 0; i < 4; ++i) {
        const double c = static_cast<double>(lengths[i]);
        const double posterior = 1.0 / std::sqrt(c * c / 0.25 + 1.0 / 0.09);
        EXPECT_NEAR(analysis->shapes[i].column_mm, c, 1e-6);
        EXPECT_NEAR(analysis->shapes[i].posterior_sigma, posterior, 1e-6);
        EXPECT_NEAR(analysis->shapes[i].confidence, 1.0 - posterior / 0.3, 1e-6);
        EXPECT_NEAR(analysis->markers[i].predicted_mm, c * posterior, 1e-6);
    }
    EXPECT_EQ(analysis->rank, 3U);
    EXPECT_NEAR(analysis->condition, 16.0, 1e-9);
    EXPECT_EQ(analysis->singular_values_mm.size(), 4U);
    EXPECT_FALSE(analysis->take);
    std::size_t markers = 0;
    for (const RegionFigures& region : analysis->regions) {
        markers += region.markers;
        EXPECT_FALSE(region.error_rms_mm);
    }
    EXPECT_EQ(markers, 8U);
}

TEST(AnalysePack, PlaysATakeAndSolvesItAgain) {
    const test::TinyRig tiny = test::tiny_rig(24, 5, 200);
    for (const SolverKind solver : {SolverKind::kBoxQp, SolverKind::kRbf}) {
        TrainOptions options;
        options.solver = solver;
        options.takes = {tiny.take};
        options.rbf.centres = 40;
        const auto trained = train(tiny.rig, tiny.layout, options);
        ASSERT_TRUE(trained) << trained.error().message;
        const auto analysis = analyse_pack(trained->view(), &tiny.take);
        ASSERT_TRUE(analysis);
        ASSERT_TRUE(analysis->take);
        EXPECT_EQ(analysis->take->frames, 200U);
        EXPECT_GT(analysis->take->weight_rms, 0.0);
        EXPECT_LT(analysis->take->weight_rms, 0.15);
        EXPECT_EQ(analysis->take->coverage.has_value(), solver == SolverKind::kRbf);
        double squares = 0.0;
        for (const MarkerFigures& marker : analysis->markers)
            squares += *marker.error_rms_mm * *marker.error_rms_mm;
        EXPECT_NEAR(std::sqrt(squares / 24.0), analysis->take->marker_rms_mm, 1e-9);
        squares = 0.0;
        for (const ShapeFigures& shape : analysis->shapes) squares += *shape.error_rms * *shape.error_rms;
        EXPECT_NEAR(std::sqrt(squares / 5.0), analysis->take->weight_rms, 1e-9);
    }
}

TEST(AnalysePack, RefusesATakeOfOtherShapes) {
    const PlainPack plain({4.0F, 1.0F});
    const test::TinyRig tiny = test::tiny_rig(24, 5, 20);
    const auto analysis = analyse_pack(plain.pack, &tiny.take);
    ASSERT_FALSE(analysis);
    EXPECT_NE(analysis.error().message.find("5 shapes"), std::string::npos);
}

TEST(RegionOf, TellsAGrownFaceApart) {
    const double height = 100.0;
    EXPECT_EQ(region_of(0, 47, height), FaceRegion::kForehead);
    EXPECT_EQ(region_of(-41, 28, height), FaceRegion::kForehead);
    EXPECT_EQ(region_of(18, -17, height), FaceRegion::kEyes);
    EXPECT_EQ(region_of(-49, -14, height), FaceRegion::kEyes);
    EXPECT_EQ(region_of(0, -32, height), FaceRegion::kNose);
    EXPECT_EQ(region_of(0, -7, height), FaceRegion::kNose);
    EXPECT_EQ(region_of(-18, -40, height), FaceRegion::kNose);
    EXPECT_EQ(region_of(42, -34, height), FaceRegion::kCheeks);
    EXPECT_EQ(region_of(0, -56, height), FaceRegion::kMouth);
    EXPECT_EQ(region_of(-31, -72, height), FaceRegion::kMouth);
    EXPECT_EQ(region_of(0, -100, height), FaceRegion::kJaw);
    EXPECT_EQ(region_of(46, -84, height), FaceRegion::kJaw);
}

}  // namespace
}  // namespace rig::host
