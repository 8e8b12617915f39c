#include "core/solve/confidence.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

struct Scene {
    explicit Scene(const test::SyntheticFaceOptions& options) : face(options), pack(face.pack()) {
        build_normal_tables(pack, *tables);
        weights.assign(face.marker_count(), Mat3::Identity());
    }

    std::vector<float> confidence() {
        follow_confidence(pack, *tables, weights, *state, *workspace);
        std::vector<float> result(face.shape_count(), -1.0F);
        read_confidence(pack, *state, result);
        return result;
    }
    // The same from nothing, and by Eigen.
    std::vector<double> from_the_formula() const {
        const std::size_t n = face.shape_count();
        const double s2 = static_cast<double>(pack.noise_mm) * static_cast<double>(pack.noise_mm);
        Eigen::MatrixXd information =
            Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n));
        for (std::size_t k = 0; k < weights.size(); ++k) {
            Eigen::MatrixXd b(3, static_cast<Eigen::Index>(n));
            for (std::size_t axis = 0; axis < 3; ++axis) {
                for (std::size_t i = 0; i < n; ++i) {
                    b(static_cast<Eigen::Index>(axis), static_cast<Eigen::Index>(i)) =
                        static_cast<double>(pack.basis_mm[(3 * k + axis) * n + i]);
                }
            }
            information += b.transpose() * weights[k] * b / s2;
        }
        std::vector<double> result(n);
        for (std::size_t i = 0; i < n; ++i) {
            information(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i)) +=
                1.0 / square(pack.prior_sigma[i]);
        }
        const Eigen::MatrixXd posterior = information.inverse();
        for (std::size_t i = 0; i < n; ++i) {
            result[i] =
                1.0 - std::sqrt(posterior(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i)) /
                                square(pack.prior_sigma[i]));
        }
        return result;
    }
    static double square(float x) { return static_cast<double>(x) * static_cast<double>(x); }

    test::SyntheticFace face;
    SolvePack pack;
    std::vector<Mat3> weights;
    std::unique_ptr<NormalTables<double>> tables = std::make_unique<NormalTables<double>>();
    std::unique_ptr<ConfidenceState> state = std::make_unique<ConfidenceState>();
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
                ASSERT_LE(after[i], before[i]) << "seed " << seed << " marker " << hidden << " shape " << i;
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

// Markers come, go and are seen by one camera, by the other, by both: P follows for thousands of terms.
TEST(Confidence, FollowsTheFormulaFromFrameToFrame) {
    test::SeededRandom random(123);
    for (const std::size_t changes : {std::size_t{1}, std::size_t{3}, std::size_t{20}}) {
        Scene s(with_bad_columns(6));
        for (int frame = 0; frame < 1000; ++frame) {
            for (std::size_t c = 0; c < changes; ++c) {
                const std::size_t k = random.below(30);
                const Vec3 ray = Vec3{random.normal(0.0, 0.3), random.normal(0.0, 0.3), -1.0}.normalized();
                const double kind = random.uniform(0.0, 3.0);
                s.weights[k] = kind < 1.0   ? Mat3(Mat3::Zero())
                               : kind < 2.0 ? Mat3(Mat3::Identity())
                                            : Mat3((Mat3::Identity() - ray * ray.transpose()) * kind);
            }
            const std::vector<float> followed = s.confidence();
            if (frame % 50 != 49) continue;
            const std::vector<double> wanted = s.from_the_formula();
            for (std::size_t i = 0; i < 24; ++i)
                ASSERT_NEAR(followed[i], wanted[i], 1e-6) << "frame " << frame;
        }
    }
}

TEST(Confidence, OfARegionIsTheShareOfItsSpreadAndFallsWithEachMarker) {
    Scene s(with_bad_columns(7));
    const std::vector<std::size_t> region{2, 5, 23};  // 23 moves nothing
    const std::vector<float> each = s.confidence();
    double posterior = 0.0;
    double prior = 0.0;
    for (const std::size_t i : region) {
        const double variance = Scene::square(s.pack.prior_sigma[i]);
        posterior += variance * std::pow(1.0 - static_cast<double>(each[i]), 2);
        prior += variance;
    }
    float before = region_confidence(s.pack.prior_sigma, each, region);
    EXPECT_NEAR(before, 1.0 - std::sqrt(posterior / prior), 1e-6);
    EXPECT_EQ(region_confidence(s.pack.prior_sigma, each, {}), 0.0F);
    for (std::size_t k = 0; k < 30; ++k) {
        s.weights[k] = Mat3::Zero();
        const float after = region_confidence(s.pack.prior_sigma, s.confidence(), region);
        ASSERT_LE(after, before);
        before = after;
    }
    EXPECT_LT(before, 1e-6F);
}

TEST(Confidence, ValuesOfSimpleCases) {
    // One marker and one shape that moves it by L: P = 1 / (L^2/s^2 + 1/sigma^2).
    test::SyntheticFaceOptions options;
    options.marker_count = 4;
    options.shape_count = 1;
    Scene s(options);
    const double known = Scene::square(s.pack.prior_sigma[0]);
    const double moved = std::pow(s.face.column_length(0), 2);
    const double noise = Scene::square(s.pack.noise_mm);
    EXPECT_NEAR(s.confidence()[0], 1.0 - std::sqrt(1.0 / (moved / noise + 1.0 / known) / known), 1e-6);
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

TEST(Confidence, ANumberThatIsNoneGivesZeroForAllUntilItGoes) {
    Scene s(with_bad_columns(10));
    const std::vector<float> before = s.confidence();
    s.weights[3](1, 1) = std::nan("");
    for (const float c : s.confidence()) EXPECT_EQ(c, 0.0F);
    s.weights[3] = Mat3::Identity();
    EXPECT_EQ(s.confidence(), before);
}

}  // namespace
}  // namespace rig
