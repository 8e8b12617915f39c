#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <vector>

#include "core/solve/rbf.hpp"
#include "tests/support/digest.hpp"
#include "tests/support/pack_samples/sample_pack.hpp"
#include "tests/support/random.hpp"

namespace rig {
namespace {

using test::SamplePack;
using test::SeededRandom;

// A random model with a random orthonormal basis (Gram-Schmidt).
void randomise(SeededRandom& random, SamplePack& sample) {
    RbfModel& rbf = sample.view.rbf;
    rbf.kernel = static_cast<RbfKernel>(random.below(3));
    const std::size_t rows = sample.rbf_mean.size();
    std::vector<std::vector<double>> axes;
    for (std::size_t a = 0; a < rbf.dimension_count; ++a) {
        std::vector<double> axis(rows);
        for (double& x : axis) x = random.normal(0.0, 1.0);
        for (const auto& other : axes) {
            double along = 0.0;
            for (std::size_t r = 0; r < rows; ++r) along += axis[r] * other[r];
            for (std::size_t r = 0; r < rows; ++r) axis[r] -= along * other[r];
        }
        double norm = 0.0;
        for (const double x : axis) norm += x * x;
        for (double& x : axis) x /= std::sqrt(norm);
        for (std::size_t r = 0; r < rows; ++r) sample.rbf_basis[a * rows + r] = static_cast<float>(axis[r]);
        axes.push_back(axis);
    }
    for (float& c : sample.rbf_centres) c = static_cast<float>(random.normal(0.0, 15.0));
    for (float& s : sample.rbf_widths) s = static_cast<float>(random.uniform(1.0, 40.0));
    // The two kernels that grow get weights that keep the sum of the size of a weight.
    const double size = rbf.kernel == RbfKernel::kGaussian ? 2.0 : 0.02;
    for (float& w : sample.rbf_weights) w = static_cast<float>(random.normal(0.0, size));
}

long double reference_height(RbfKernel kernel, long double u) {
    if (kernel == RbfKernel::kMultiquadric) return std::sqrt(1.0L + u);
    if (kernel == RbfKernel::kThinPlate) return u > 0.0L ? 0.5L * u * std::log(u) : 0.0L;
    return std::exp(-0.5L * u);
}

struct Reference {
    std::vector<double> weights;
    double magnitude = 0.0;  // the largest sum of |W h| of a weight: what single precision rounds
};

// The formula of the paper in long double and another order of summation.
Reference reference(const SolvePack& pack, const std::vector<float>& t) {
    const RbfModel& rbf = pack.rbf;
    std::vector<long double> x(rbf.dimension_count);
    for (std::size_t a = 0; a < x.size(); ++a) {
        for (std::size_t r = t.size(); r-- > 0;) {
            x[a] += static_cast<long double>(rbf.basis[a * t.size() + r]) *
                    (static_cast<long double>(t[r]) - static_cast<long double>(rbf.mean_mm[r]));
        }
    }
    std::vector<long double> w(pack.shape_count);
    std::vector<long double> magnitude(pack.shape_count);
    for (std::size_t k = rbf.centre_count; k-- > 0;) {
        long double squared = 0.0L;
        for (std::size_t a = 0; a < x.size(); ++a) {
            const long double gap = x[a] - static_cast<long double>(rbf.centres[k * x.size() + a]);
            squared += gap * gap;
        }
        const auto width = static_cast<long double>(rbf.widths_mm[k]);
        const long double height = reference_height(rbf.kernel, squared / (width * width));
        for (std::size_t i = 0; i < w.size(); ++i) {
            const long double term = height * static_cast<long double>(rbf.weights[k * w.size() + i]);
            w[i] += term;
            magnitude[i] += std::abs(term);
        }
    }
    Reference out;
    for (std::size_t i = 0; i < w.size(); ++i) {
        const long double value = w[i] + static_cast<long double>(rbf.offset[i]);
        out.weights.push_back(std::clamp(static_cast<double>(value), static_cast<double>(pack.weight_low[i]),
                                         static_cast<double>(pack.weight_high[i])));
        out.magnitude = std::max(out.magnitude, static_cast<double>(magnitude[i]));
    }
    return out;
}

TEST(RbfProperties, EqualsTheFormulaInLongDouble) {
    SeededRandom random(11);
    const auto tables = std::make_unique<RbfTables>();
    const auto workspace = std::make_unique<RbfWorkspace>();
    for (int round = 0; round < 60; ++round) {
        SamplePack sample({.markers = static_cast<std::uint16_t>(4 + random.below(40)),
                           .shapes = static_cast<std::uint16_t>(1 + random.below(60)),
                           .solver = SolverKind::kRbf,
                           .rbf_dimensions = static_cast<std::uint16_t>(1 + random.below(12)),
                           .rbf_centres = static_cast<std::uint16_t>(1 + random.below(kMaxRbfCentres))});
        randomise(random, sample);
        build_rbf_tables(sample.view, *tables);
        std::vector<float> weights(sample.view.shape_count);
        for (int frame = 0; frame < 20; ++frame) {
            std::vector<float> t = sample.rbf_mean;
            for (float& x : t) x += static_cast<float>(random.normal(0.0, 5.0));
            static_cast<void>(evaluate_rbf(*tables, t, *workspace, weights));
            const Reference wanted = reference(sample.view, t);
            // A coordinate x of some 30 mm is wrong by 1e-6 mm and u, whose slope is 2 sqrt(u) / s with s >=
            // 1 mm, by 1e-5 at most; then every term is, and the K terms are summed one after the other.
            const double bound = 1e-6 + 1.5e-5 * wanted.magnitude;
            for (std::size_t i = 0; i < weights.size(); ++i)
                ASSERT_NEAR(static_cast<double>(weights[i]), wanted.weights[i], bound) << round;
        }
    }
}

TEST(RbfProperties, AnyBitsGiveFiniteWeightsInRange) {
    SeededRandom random(12);
    const auto tables = std::make_unique<RbfTables>();
    const auto workspace = std::make_unique<RbfWorkspace>();
    for (const RbfKernel kernel : {RbfKernel::kGaussian, RbfKernel::kThinPlate, RbfKernel::kMultiquadric}) {
        SamplePack sample({.markers = 20,
                           .shapes = 10,
                           .solver = SolverKind::kRbf,
                           .rbf_dimensions = 6,
                           .rbf_centres = 30});
        randomise(random, sample);
        sample.view.rbf.kernel = kernel;
        // The largest and the smallest numbers that a pack may hold.
        for (float& s : sample.rbf_widths) s = random.chance(0.5) ? 1e-3F : 1e6F;
        for (float& w : sample.rbf_weights) w = random.chance(0.5) ? 1e6F : -1e6F;
        build_rbf_tables(sample.view, *tables);
        std::vector<float> weights(10);
        for (int frame = 0; frame < 10000; ++frame) {
            std::vector<float> t(60);
            for (float& x : t) x = std::bit_cast<float>(static_cast<std::uint32_t>(random.bits()));
            const RbfReport report = evaluate_rbf(*tables, t, *workspace, weights);
            ASSERT_TRUE(std::isfinite(report.nearest_widths));
            for (const float w : weights) ASSERT_TRUE(w >= 0.0F && w <= 1.0F);
        }
    }
}

// Equal bits on every machine, vector width and compiler option.
TEST(RbfProperties, HasTheSameBitsEverywhere) {
    SeededRandom random(13);
    const auto tables = std::make_unique<RbfTables>();
    const auto workspace = std::make_unique<RbfWorkspace>();
    test::Digest digest;
    for (int round = 0; round < 30; ++round) {
        const auto markers = static_cast<std::uint16_t>(4 + random.below(60));
        const auto shapes = static_cast<std::uint16_t>(1 + random.below(140));
        const auto dimensions = static_cast<std::uint16_t>(1 + random.below(12));
        const auto centres = static_cast<std::uint16_t>(1 + random.below(kMaxRbfCentres));
        SamplePack sample({.markers = markers,
                           .shapes = shapes,
                           .solver = SolverKind::kRbf,
                           .rbf_dimensions = dimensions,
                           .rbf_centres = centres});
        randomise(random, sample);
        build_rbf_tables(sample.view, *tables);
        std::vector<float> weights(sample.view.shape_count);
        for (int frame = 0; frame < 10; ++frame) {
            std::vector<float> t = sample.rbf_mean;
            for (float& x : t) x += static_cast<float>(random.normal(0.0, 5.0));
            const RbfReport report = evaluate_rbf(*tables, t, *workspace, weights);
            digest.add(std::span<const float>(weights)).add(report.nearest_widths);
            digest.add(std::span<const float>(workspace->weights));
        }
    }
    EXPECT_EQ(digest.value(), 2795563117593481574ULL);
}

}  // namespace
}  // namespace rig
