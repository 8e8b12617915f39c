#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

#include "core/solve/rbf.hpp"
#include "tests/support/pack_samples/sample_pack.hpp"
#include "tests/support/random.hpp"

namespace rig {
namespace {

using test::SamplePack;
using test::SeededRandom;

// A random model with a random orthonormal basis (Gram-Schmidt).
void randomise(SeededRandom& random, SamplePack& sample) {
    RbfModel& rbf = sample.view.rbf;
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
    for (float& w : sample.rbf_weights) w = static_cast<float>(random.normal(0.0, 2.0));
}

// The formula of the paper in long double and another order of summation.
std::vector<double> reference(const SolvePack& pack, const std::vector<float>& t) {
    const RbfModel& rbf = pack.rbf;
    std::vector<long double> x(rbf.dimension_count);
    for (std::size_t a = 0; a < x.size(); ++a) {
        for (std::size_t r = t.size(); r-- > 0;) {
            x[a] += static_cast<long double>(rbf.basis[a * t.size() + r]) *
                    (static_cast<long double>(t[r]) - static_cast<long double>(rbf.mean_mm[r]));
        }
    }
    std::vector<long double> w(pack.shape_count);
    for (std::size_t k = rbf.centre_count; k-- > 0;) {
        long double squared = 0.0L;
        for (std::size_t a = 0; a < x.size(); ++a) {
            const long double gap = x[a] - static_cast<long double>(rbf.centres[k * x.size() + a]);
            squared += gap * gap;
        }
        const auto width = static_cast<long double>(rbf.widths_mm[k]);
        const long double height = std::exp(-squared / (2.0L * width * width));
        for (std::size_t i = 0; i < w.size(); ++i)
            w[i] += height * static_cast<long double>(rbf.weights[k * w.size() + i]);
    }
    std::vector<double> out;
    for (std::size_t i = 0; i < w.size(); ++i) {
        const long double value = w[i] + static_cast<long double>(rbf.offset[i]);
        out.push_back(std::clamp(static_cast<double>(value), static_cast<double>(pack.weight_low[i]),
                                 static_cast<double>(pack.weight_high[i])));
    }
    return out;
}

TEST(RbfProperties, EqualsTheFormulaInLongDouble) {
    SeededRandom random(11);
    for (int round = 0; round < 60; ++round) {
        SamplePack sample({.markers = static_cast<std::uint16_t>(4 + random.below(40)),
                           .shapes = static_cast<std::uint16_t>(1 + random.below(60)),
                           .solver = SolverKind::kRbf,
                           .rbf_dimensions = static_cast<std::uint16_t>(1 + random.below(12)),
                           .rbf_centres = static_cast<std::uint16_t>(1 + random.below(kMaxRbfCentres))});
        randomise(random, sample);
        RbfWorkspace workspace;
        std::vector<double> weights(sample.view.shape_count);
        for (int frame = 0; frame < 20; ++frame) {
            std::vector<float> t = sample.rbf_mean;
            for (float& x : t) x += static_cast<float>(random.normal(0.0, 5.0));
            static_cast<void>(evaluate_rbf(sample.view, t, workspace, weights));
            const std::vector<double> wanted = reference(sample.view, t);
            // K terms of size |W| <= 10: rounding of a double sum stays under K * 10 * 2^-50.
            for (std::size_t i = 0; i < weights.size(); ++i)
                ASSERT_NEAR(weights[i], wanted[i], 3e-12) << round;
        }
    }
}

TEST(RbfProperties, AnyBitsGiveFiniteWeightsInRange) {
    SeededRandom random(12);
    SamplePack sample(
        {.markers = 20, .shapes = 10, .solver = SolverKind::kRbf, .rbf_dimensions = 6, .rbf_centres = 30});
    randomise(random, sample);
    RbfWorkspace workspace;
    std::vector<double> weights(10);
    for (int frame = 0; frame < 20000; ++frame) {
        std::vector<float> t(60);
        for (float& x : t) x = std::bit_cast<float>(static_cast<std::uint32_t>(random.bits()));
        const RbfReport report = evaluate_rbf(sample.view, t, workspace, weights);
        ASSERT_TRUE(std::isfinite(report.nearest_widths));
        for (const double w : weights) ASSERT_TRUE(w >= 0.0 && w <= 1.0);
    }
}

}  // namespace
}  // namespace rig
