#include "core/solve/confidence.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/dense.hpp"

namespace rig {

void weight_confidence(const ConfidenceInput& input, ConfidenceWorkspace& w, std::span<float> confidence) {
    constexpr std::size_t kStride = kMaxShapes;
    const std::size_t n = input.prior_sigma.size();
    const double s2 = input.noise_mm * input.noise_mm;
    for (std::size_t i = 0; i < n; ++i) {
        const double sigma = static_cast<double>(input.prior_sigma[i]);
        for (std::size_t j = 0; j < i; ++j)
            w.posterior[i * kStride + j] = input.gram_mm2[i * kStride + j] / s2;
        w.posterior[i * kStride + i] = input.diagonal_mm2[i] / s2 + 1.0 / (sigma * sigma);
        confidence[i] = 0.0F;
    }
    if (!cholesky(w.posterior.data(), w.posterior.data(), n, kStride)) return;
    inverse_diagonal(w.posterior.data(), n, kStride, w.diagonal.data(), w.scratch.data());
    for (std::size_t i = 0; i < n; ++i) {
        const double left = std::sqrt(w.diagonal[i]) / static_cast<double>(input.prior_sigma[i]);
        confidence[i] = static_cast<float>(std::clamp(1.0 - left, 0.0, 1.0));
    }
}

}  // namespace rig
