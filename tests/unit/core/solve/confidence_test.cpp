#include "core/solve/confidence.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "core/solve/normal_equations.hpp"
#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

struct Scene {
    explicit Scene(const test::SyntheticFaceOptions& options) : face(options), pack(face.pack()) {
        build_normal_tables(pack, *tables);
        positions = face.positions(std::vector<double>(face.shape_count(), 0.0));
        previous.assign(face.shape_count(), 0.0);
        weights.assign(face.marker_count(), Mat3::Identity());
    }

    std::vector<float> confidence() {
        build_normal_equations(pack, *tables, {positions, weights, previous, 0.0}, *state, *qp, *equations);
        const std::size_t n = face.shape_count();
        std::vector<double> gram(n * kMaxShapes);
        std::vector<double> diagonal(n);
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = 0; j < n; ++j)
                gram[i * kMaxShapes + j] = state->hessian[i * row_stride(n) + j];
            diagonal[i] = gram[i * kMaxShapes + i] - state->regularisation[i];
        }
        std::vector<float> result(face.shape_count(), -1.0F);
        weight_confidence({gram, diagonal, pack.prior_sigma, static_cast<double>(pack.noise_mm)}, *workspace,
                          result);
        return result;
    }

    test::SyntheticFace face;
    SolvePack pack;
    std::vector<Vec3> positions;
    std::vector<double> previous;
    std::vector<Mat3> weights;
    std::unique_ptr<NormalTables<double>> tables = std::make_unique<NormalTables<double>>();
    std::unique_ptr<NormalState<double>> state = std::make_unique<NormalState<double>>();
    std::unique_ptr<BoxQpState<double>> qp = std::make_unique<BoxQpState<double>>();
    std::unique_ptr<NormalEquations<double>> equations = std::make_unique<NormalEquations<double>>();
    std::unique_ptr<ConfidenceWorkspace> workspace = std::make_unique<ConfidenceWorkspace>();
};

test::SyntheticFaceOptions with_bad_columns(std::uint64_t seed) {
    test::SyntheticFaceOptions options;
    options.marker_count = 30;
    options.shape_count = 24;
    options.duplicate_columns = 1;
    options.dependent_columns = 1;
    options.zero_columns = 1;
    options.seed = seed;
    return options;
}

TEST(Confidence, HidingAMarkerNeverRaisesAny) {
    test::SeededRandom random(121);
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        Scene s(with_bad_columns(seed));
        std::vector<float> before = s.confidence();
        std::vector<std::size_t> order(30);
        for (std::size_t k = 0; k < 30; ++k) order[k] = k;
        random.shuffle(std::span<std::size_t>(order));
        for (const std::size_t hidden : order) {
            s.weights[hidden] = Mat3::Zero();
            const std::vector<float> after = s.confidence();
            for (std::size_t i = 0; i < 24; ++i) {
                ASSERT_GE(after[i], 0.0F);
                ASSERT_LE(after[i], 1.0F);
                ASSERT_LE(after[i], before[i] + 2e-6F)
                    << "seed " << seed << " marker " << hidden << " shape " << i;
            }
            before = after;
        }
        for (const float c : before) EXPECT_LT(c, 1e-6F) << "nothing seen, nothing known";
    }
}

TEST(Confidence, LosingTheDepthNeverRaisesAny) {
    test::SeededRandom random(122);
    Scene s(with_bad_columns(5));
    std::vector<float> before = s.confidence();
    for (std::size_t k = 0; k < 30; ++k) {
        const Vec3 ray = Vec3{random.normal(0.0, 0.3), random.normal(0.0, 0.3), -1.0}.normalized();
        s.weights[k] = Mat3::Identity() - ray * ray.transpose();
        const std::vector<float> after = s.confidence();
        for (std::size_t i = 0; i < 24; ++i) ASSERT_LE(after[i], before[i] + 2e-6F);
        before = after;
    }
}

TEST(Confidence, ValuesOfSimpleCases) {
    // One shape with column length L: P = 1 / (L^2/s^2 + 1/sigma^2).
    std::vector<double> gram(kMaxShapes * kMaxShapes, 0.0);
    std::vector<double> diagonal{4.0, 0.0};
    const std::vector<float> sigma{0.3F, 0.5F};
    std::vector<float> confidence(2);
    auto workspace = std::make_unique<ConfidenceWorkspace>();
    weight_confidence({gram, diagonal, sigma, 0.1}, *workspace, confidence);
    const double known = static_cast<double>(sigma[0]);
    const double expected = 1.0 - std::sqrt(1.0 / (4.0 / 0.01 + 1.0 / (known * known))) / known;
    EXPECT_NEAR(static_cast<double>(confidence[0]), expected, 1e-7);
    EXPECT_EQ(confidence[1], 0.0F) << "an invisible shape";
}

TEST(Confidence, DuplicatesShareTheirDoubt) {
    test::SyntheticFaceOptions options = with_bad_columns(9);
    Scene s(options);
    const std::vector<float> c = s.confidence();
    // Column 21 copies column 0: only their sum is seen, each keeps 1/sqrt(2) of its prior spread.
    EXPECT_NEAR(c[21], 1.0 - std::sqrt(0.5), 0.02);
    EXPECT_NEAR(c[0], c[21], 1e-5);
    EXPECT_EQ(c[23], 0.0F);
}

TEST(Confidence, ANumberThatIsNoneGivesZeroForAll) {
    std::vector<double> gram(kMaxShapes * kMaxShapes, 0.0);
    const std::vector<double> diagonal{std::nan(""), 1.0};
    const std::vector<float> sigma{0.3F, 0.3F};
    std::vector<float> confidence(2, 0.7F);
    auto workspace = std::make_unique<ConfidenceWorkspace>();
    weight_confidence({gram, diagonal, sigma, 0.1}, *workspace, confidence);
    EXPECT_EQ(confidence[0], 0.0F);
    EXPECT_EQ(confidence[1], 0.0F);
}

}  // namespace
}  // namespace rig
