#include "core/solve/regional.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "tests/support/pack_samples/sample_pack.hpp"
#include "tests/support/random.hpp"

namespace rig {
namespace {

using test::SamplePack;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class Face {
  public:
    explicit Face(SolverKind solver, std::uint16_t markers = 12, std::uint16_t shapes = 4)
        : sample({.markers = markers, .shapes = shapes, .solver = solver}),
          positions(markers),
          weights(markers, Mat3::Identity()),
          confidence(shapes, 0.5F),
          shape_weights(shapes, 0.0) {
        build_regional_tables(sample.view, *tables);
        combine({{0.2, 0.3, 0.5}, {0.6, 0.4}});
    }

    // Positions that both regions make from these coefficients; region 0 has the say about shared markers.
    void combine(const std::vector<std::vector<double>>& c) {
        for (std::size_t r = 2; r-- > 0;) {
            const RegionModel& region = sample.view.regions[r];
            const std::size_t stride = padded(region.example_count);
            for (std::size_t a = 0; a < region.marker_count; ++a) {
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    double x = static_cast<double>(region.origin_mm[3 * a + axis]);
                    for (std::size_t j = 0; j < c[r].size(); ++j)
                        x += c[r][j] * static_cast<double>(region.examples_mm[(3 * a + axis) * stride + j]);
                    positions[region.markers[a]][static_cast<Eigen::Index>(axis)] = x;
                }
            }
        }
    }

    void solve() {
        solve_regions(sample.view, *tables, {positions, weights, confidence}, *state, *workspace, output,
                      shape_weights);
    }

    SamplePack sample;
    std::unique_ptr<RegionalTables> tables = std::make_unique<RegionalTables>();
    std::unique_ptr<RegionalState> state = std::make_unique<RegionalState>();
    std::unique_ptr<RegionalWorkspace> workspace = std::make_unique<RegionalWorkspace>();
    std::vector<Vec3> positions;
    std::vector<Mat3> weights;
    std::vector<float> confidence;
    std::vector<double> shape_weights;
    RegionalOutput output;
};

TEST(Regional, FindsTheCoefficientsOfBothSolvers) {
    for (const SolverKind solver : {SolverKind::kKeyShapes, SolverKind::kExamples}) {
        Face face(solver);
        face.solve();
        EXPECT_NEAR(face.output.coefficients[0][0], 0.2, 1e-4);
        EXPECT_NEAR(face.output.coefficients[0][1], 0.3, 1e-4);
        EXPECT_NEAR(face.output.coefficients[0][2], 0.5, 1e-4);
        EXPECT_LT(face.output.regions[0].residual_rms_mm, 1e-3);
        EXPECT_EQ(face.output.regions[0].rows_used, 9);
        EXPECT_TRUE(face.output.regions[0].optimal);
        EXPECT_TRUE(face.output.regions[1].optimal);
        EXPECT_LT(face.output.regions[0].kkt, 1e-5);
    }
}

TEST(Regional, BlendsTheShapesOfItsRegions) {
    Face face(SolverKind::kKeyShapes);
    face.solve();
    for (std::size_t i = 0; i < 4; ++i) {
        double wanted = 0.0;
        for (std::size_t r = 0; r < 2; ++r) {
            const RegionModel& region = face.sample.view.regions[r];
            for (std::size_t j = 0; j < region.example_count; ++j) {
                wanted += static_cast<double>(region.shape_blend[i]) *
                          static_cast<double>(face.output.coefficients[r][j]) *
                          static_cast<double>(region.shapes[j * 4 + i]);
            }
        }
        EXPECT_NEAR(face.shape_weights[i], wanted, 1e-12);
    }
}

TEST(Regional, ConfidenceIsThatOfTheShapesARegionSpeaksFor) {
    Face face(SolverKind::kExamples);
    face.confidence = {0.8F, 0.1F, 0.4F, 0.3F};
    face.solve();
    // Region 0 has half of shape 0 and all of shape 2, region 1 half of shape 0 and all of 1 and 3.
    const auto of = [&](std::vector<std::pair<std::size_t, double>> shares) {
        double prior = 0.0, posterior = 0.0;
        for (const auto& [i, share] : shares) {
            const double sigma = static_cast<double>(face.sample.view.prior_sigma[i]);
            const double left = sigma * (1.0 - static_cast<double>(face.confidence[i]));
            prior += share * sigma * sigma;
            posterior += share * left * left;
        }
        return 1.0 - std::sqrt(posterior / prior);
    };
    EXPECT_NEAR(face.output.regions[0].confidence, of({{0, 0.5}, {2, 1.0}}), 1e-6);
    EXPECT_NEAR(face.output.regions[1].confidence, of({{0, 0.5}, {1, 1.0}, {3, 1.0}}), 1e-6);
    face.confidence[2] = 0.3F;
    const float before = face.output.regions[0].confidence;
    face.solve();
    EXPECT_LT(face.output.regions[0].confidence, before);
}

TEST(Regional, HiddenMarkersAreLeftOutAndAHiddenRegionHolds) {
    for (const SolverKind solver : {SolverKind::kKeyShapes, SolverKind::kExamples}) {
        Face face(solver);
        face.solve();
        const auto before = face.output.coefficients;
        face.weights[4] = Mat3::Zero();
        face.positions[4] = Vec3(1e5, 0, 0);  // of a marker not seen: means nothing
        face.positions[5] = Vec3(kNan, 1, 2);
        face.solve();
        EXPECT_EQ(face.output.regions[1].rows_used, 3 * 10 - 6);
        for (std::size_t k = 0; k < 3; ++k) face.weights[k] = Mat3::Zero();
        face.combine({{1, 0, 0}, {0, 1}});
        face.solve();
        EXPECT_EQ(face.output.regions[0].rows_used, 0);
        EXPECT_EQ(face.output.regions[0].residual_rms_mm, 0.0);
        for (std::size_t j = 0; j < 3; ++j) EXPECT_NEAR(face.output.coefficients[0][j], before[0][j], 1e-4);
        EXPECT_NEAR(face.output.coefficients[1][1], 1.0, 1e-4);
    }
}

TEST(Regional, AMarkerSeenByOneCameraCountsAcrossTheRay) {
    Face face(SolverKind::kExamples);
    face.weights[0] = Vec3(1, 1, 0).asDiagonal();  // seen from the front: nothing along z
    face.positions[0][2] += 40.0;
    face.solve();
    EXPECT_EQ(face.output.regions[0].rows_used, 8);
    EXPECT_NEAR(face.output.coefficients[0][2], 0.5, 1e-4);
}

TEST(Regional, AnyNumbersGiveFiniteWeights) {
    test::SeededRandom random(5);
    for (const SolverKind solver : {SolverKind::kKeyShapes, SolverKind::kExamples}) {
        Face face(solver);
        for (int frame = 0; frame < 3000; ++frame) {
            for (Vec3& p : face.positions) {
                for (Eigen::Index axis = 0; axis < 3; ++axis) p[axis] = std::bit_cast<double>(random.bits());
            }
            for (Mat3& v : face.weights) {
                v = Mat3::Identity() *
                    (random.chance(0.3) ? std::bit_cast<double>(random.bits()) : random.uniform(0.0, 2.0));
            }
            face.solve();
            for (const double w : face.shape_weights) ASSERT_TRUE(std::isfinite(w)) << frame;
        }
    }
}

}  // namespace
}  // namespace rig
