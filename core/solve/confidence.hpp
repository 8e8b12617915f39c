// How well each weight is known: the share of its prior spread that the markers seen take away.
//
//   P = (B^T V B / s^2 + P0^-1)^-1,   confidence_i = 1 - sqrt(P_ii / P0_ii)          (methods.md section 3)
//
// The active set is ignored on purpose: with it, hiding a marker could raise a confidence; without it, never.
#pragma once

#include <array>
#include <span>

#include "core/limits.hpp"

namespace rig {

struct ConfidenceInput {
    std::span<const double>
        gram_mm2;  // B^T V B, lower triangle, rows kMaxShapes apart; its diagonal is not read
    std::span<const double> diagonal_mm2;  // [N] the diagonal of B^T V B
    std::span<const float> prior_sigma;    // [N] sqrt of P0_ii, > 0
    double noise_mm = 0.1;                 // s
};

struct ConfidenceWorkspace {
    std::array<double, kMaxShapes * kMaxShapes> posterior{};
    std::array<double, kMaxShapes> diagonal{};
    std::array<double, kMaxShapes> scratch{};
};

// confidence [N], 0..1; all zero when the posterior is not positive definite.
void weight_confidence(const ConfidenceInput& input, ConfidenceWorkspace& workspace,
                       std::span<float> confidence);

}  // namespace rig
