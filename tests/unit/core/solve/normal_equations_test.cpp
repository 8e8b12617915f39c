#include "core/solve/normal_equations.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "tests/support/synthetic_face.hpp"

namespace rig {
namespace {

struct Scene {
    explicit Scene(std::uint64_t seed) : random(seed) {
        test::SyntheticFaceOptions options;
        options.marker_count = 24;
        options.shape_count = 16;
        options.duplicate_columns = 1;
        options.zero_columns = 1;
        options.temporal_gamma_mm2 = 0.7;
        options.ridge_mm2 = 0.01;
        options.seed = seed;
        face = std::make_unique<test::SyntheticFace>(options);
        pack = face->pack();
        pack.sparsity_mm2 = 0.3F;
        low.assign(pack.weight_low.begin(), pack.weight_low.end());
        low[4] = -0.5F;  // |w| is not linear there
        pack.weight_low = low;
        build_normal_tables(pack, *tables);
        positions = face->positions(face->random_weights(random));
        test::add_noise(positions, 0.3, random);
        weights.assign(24, Mat3::Identity());
        for (std::size_t i = 0; i < 16; ++i) previous.push_back(random.uniform(0.0, 1.0));
    }

    [[nodiscard]] NormalInput input() const { return {positions, weights, previous, gamma_scale}; }

    void build() { build_normal_equations(pack, *tables, input(), *state, *qp, *equations); }
    [[nodiscard]] double h(std::size_t i, std::size_t j) const {
        return state->hessian[i * row_stride(16) + j];
    }

    void hide(int count) {
        for (int i = 0; i < count; ++i) weights[random.below(24)] = Mat3::Zero();
    }
    void turn_into_rays(double share) {
        for (Mat3& v : weights) {
            if (!random.chance(share)) continue;
            const Vec3 ray = Vec3{random.normal(0.0, 0.3), random.normal(0.0, 0.3), -1.0}.normalized();
            v = random.uniform(0.5, 3.0) * (Mat3::Identity() - ray * ray.transpose());
        }
    }

    // E(w) by its definition, in long double.
    [[nodiscard]] long double energy(const std::vector<double>& w, long double* data = nullptr) const {
        long double sum = 0.0L;
        for (std::size_t k = 0; k < 24; ++k) {
            std::array<long double, 3> e{};
            for (std::size_t a = 0; a < 3; ++a) {
                e[a] = static_cast<long double>(pack.neutral_mm[3 * k + a]) -
                       static_cast<long double>(positions[k][static_cast<Eigen::Index>(a)]);
                for (std::size_t i = 0; i < 16; ++i) {
                    e[a] += static_cast<long double>(pack.basis_mm[(3 * k + a) * 16 + i]) *
                            static_cast<long double>(w[i]);
                }
            }
            for (std::size_t a = 0; a < 3; ++a) {
                for (std::size_t b = 0; b < 3; ++b) {
                    sum += e[a] * e[b] *
                           static_cast<long double>(
                               weights[k](static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)));
                }
            }
        }
        if (data != nullptr) *data = sum;
        for (std::size_t i = 0; i < 16; ++i) {
            const auto x = static_cast<long double>(w[i]);
            const long double d = x - static_cast<long double>(previous[i]);
            sum += (low[i] < 0.0F ? 0.0L : static_cast<long double>(pack.sparsity_mm2) * x) +
                   static_cast<long double>(pack.ridge_mm2) * x * x;
            sum += static_cast<long double>(gamma_scale) * static_cast<long double>(pack.temporal_gamma[i]) *
                   d * d;
        }
        return sum;
    }

    test::SeededRandom random;
    std::unique_ptr<test::SyntheticFace> face;
    SolvePack pack;
    std::unique_ptr<NormalTables<double>> tables = std::make_unique<NormalTables<double>>();
    std::unique_ptr<NormalState<double>> state = std::make_unique<NormalState<double>>();
    std::unique_ptr<BoxQpState<double>> qp = std::make_unique<BoxQpState<double>>();
    std::unique_ptr<NormalEquations<double>> equations = std::make_unique<NormalEquations<double>>();
    std::vector<Vec3> positions;
    std::vector<Mat3> weights;
    std::vector<float> low;
    std::vector<double> previous;
    double gamma_scale = 0.5;
};

// The quadratic E(w) = w^T H w + 2 q^T w + constant must be the definition's, at any w >= 0.
void expect_same_energy(Scene& s, const char* what) {
    s.build();
    const NormalEquations<double>& e = *s.equations;
    for (int trial = 0; trial < 5; ++trial) {
        std::vector<double> w;
        for (std::size_t i = 0; i < 16; ++i) w.push_back(s.random.uniform(0.0, 1.0));
        long double sum = static_cast<long double>(e.constant_mm2);
        for (std::size_t i = 0; i < 16; ++i) {
            for (std::size_t j = 0; j < 16; ++j) {
                sum += static_cast<long double>(w[i]) * static_cast<long double>(s.h(i, j)) *
                       static_cast<long double>(w[j]);
            }
            sum += 2.0L * static_cast<long double>(e.linear[i]) * static_cast<long double>(w[i]);
        }
        const long double expected = s.energy(w);
        // What keeps H positive definite is 1e-9 of the largest entry with all markers seen.
        EXPECT_NEAR(static_cast<double>(sum / expected), 1.0, 1e-6) << what;
    }
    for (std::size_t i = 0; i < 16; ++i) {
        for (std::size_t j = 0; j < 16; ++j) {
            EXPECT_EQ(s.h(i, j), s.h(j, i)) << "both triangles";
        }
        long double diagonal = 0.0L;
        for (std::size_t k = 0; k < 24; ++k) {
            Vec3 b;
            for (std::size_t a = 0; a < 3; ++a) {
                b[static_cast<Eigen::Index>(a)] = static_cast<double>(s.pack.basis_mm[(3 * k + a) * 16 + i]);
            }
            diagonal += static_cast<long double>(b.dot(Vec3{s.weights[k] * b}));
        }
        EXPECT_NEAR(s.h(i, i) - s.state->regularisation[i], static_cast<double>(diagonal),
                    1e-10 * (1.0 + static_cast<double>(diagonal)));
    }
}

TEST(NormalEquations, AreTheEnergyWithAllMarkers) {
    Scene s(111);
    expect_same_energy(s, "all seen");
    EXPECT_EQ(s.equations->markers_used, 24U);
}

TEST(NormalEquations, AreTheEnergyWithFewAndWithManyMissing) {
    for (const int missing : {1, 4, 11, 20, 60}) {
        Scene s(112);
        s.hide(missing);
        expect_same_energy(s, "missing");
        std::size_t seen = 0;
        for (const Mat3& v : s.weights) seen += v.norm() > 0.0 ? 1U : 0U;
        EXPECT_EQ(s.equations->markers_used, seen);
    }
}

TEST(NormalEquations, AreTheEnergyOfRays) {
    for (const double share : {0.2, 1.0}) {
        Scene s(113);
        s.turn_into_rays(share);
        s.hide(3);
        expect_same_energy(s, "rays");
    }
}

TEST(NormalEquations, WithoutAPreviousSolutionThereIsNoPull) {
    Scene s(114);
    s.gamma_scale = 0.0;
    s.previous.assign(16, 1e30);
    s.pack.temporal_gamma = {};
    const std::vector<float> gamma(16, 4.0F);
    s.pack.temporal_gamma = gamma;
    s.build();
    Scene without(114);
    const std::vector<float> zero(16, 0.0F);
    without.pack.temporal_gamma = zero;
    without.build();
    for (std::size_t i = 0; i < 16; ++i) {
        EXPECT_EQ(s.equations->linear[i], without.equations->linear[i]);
        EXPECT_EQ(s.h(i, i), without.h(i, i));
    }
}

TEST(NormalEquations, NothingSeenIsStillPositiveDefinite) {
    Scene s(115);
    s.weights.assign(24, Mat3::Zero());
    s.gamma_scale = 0.0;
    const float ridge = 0.0F;
    s.pack.ridge_mm2 = ridge;
    s.build();
    EXPECT_EQ(s.equations->markers_used, 0U);
    for (std::size_t i = 0; i < 16; ++i) EXPECT_GT(s.h(i, i), 0.0);
}

TEST(NormalEquations, ResidualIsTheRootMeanSquareOfTheMeasuredCoordinates) {
    Scene s(116);
    s.hide(5);
    std::vector<double> w(16, 0.3);
    long double data = 0.0L;
    static_cast<void>(s.energy(w, &data));
    double coordinates = 0.0;
    for (const Mat3& v : s.weights) coordinates += v.trace();
    EXPECT_NEAR(residual_rms_mm(s.pack, *s.tables, s.input(), std::span<const double>(w)),
                std::sqrt(static_cast<double>(data) / coordinates), 1e-10);
    s.weights.assign(24, Mat3::Zero());
    EXPECT_EQ(residual_rms_mm(s.pack, *s.tables, s.input(), std::span<const double>(w)), 0.0);
    // A known case: every seen coordinate 2 mm off.
    s.weights.assign(24, Mat3::Identity());
    s.positions = s.face->positions(w);
    for (Vec3& x : s.positions) x += Vec3{2.0, -2.0, 2.0};
    EXPECT_NEAR(residual_rms_mm(s.pack, *s.tables, s.input(), std::span<const double>(w)), 2.0, 1e-9);
}

// Visibility changes from frame to frame: H follows, and is the definition's at every step.
TEST(NormalEquations, FollowWhatIsSeenFromFrameToFrame) {
    Scene s(117);
    std::uint32_t version = 0;
    for (int frame = 0; frame < 300; ++frame) {
        const bool quiet = frame % 3 == 1;
        if (!quiet) {
            const std::size_t k = s.random.below(24);
            const bool seen = s.weights[k].norm() > 0.0;
            s.weights[k] = seen ? Mat3(Mat3::Zero()) : Mat3(s.random.uniform(0.5, 2.0) * Mat3::Identity());
            if (!seen && s.random.chance(0.5)) {
                const Vec3 ray =
                    Vec3{s.random.normal(0.0, 0.3), s.random.normal(0.0, 0.3), -1.0}.normalized();
                s.weights[k] -= ray * ray.transpose() * s.weights[k](0, 0);
            }
        }
        expect_same_energy(s, "followed");
        EXPECT_EQ(s.equations->changed, !quiet) << frame;
        EXPECT_EQ(s.state->version == version, quiet) << frame;
        version = s.state->version;
    }
}

TEST(NormalEquations, SmallChangesOfInformationWait) {
    Scene s(118);
    s.build();
    const std::uint32_t version = s.state->version;
    for (Mat3& v : s.weights) v *= 1.02;
    s.build();
    EXPECT_EQ(s.state->version, version);
    for (Mat3& v : s.weights) v *= 1.2;
    s.build();
    EXPECT_NE(s.state->version, version);
}

}  // namespace
}  // namespace rig
