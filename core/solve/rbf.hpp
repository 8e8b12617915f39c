// Gaussian radial basis function regression from marker positions to weights [Deng06 eq. 3-6]:
//
//   x = E (t - mean)                                    E [d x 3m] orthonormal rows: the principal axes of
//   the training h_k = exp(-|x - c_k|^2 / (2 s_k^2))                 c_k the reference frames, s_k their
//   widths w = W^T h + offset, clamped into [low, high]        clamping is ours
//
// Evaluation only: training is the host's (firmware_host/companion/train). It interpolates between its
// references and knows nothing beyond them, so how far a face is from the nearest one is part of the report.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/pack/solve_pack.hpp"

namespace rig {

struct RbfWorkspace {
    std::array<double, kMaxRbfDimensions> point_mm{};  // x
    std::array<double, kMaxRbfCentres> heights{};      // h
};

struct RbfReport {
    std::uint16_t nearest_centre = 0;
    // min_k |x - c_k| / s_k: under about 2 the references speak; beyond 3 every height is under 0.011 and the
    // answer is mostly the offset.
    double nearest_widths = 0.0;
    std::uint16_t coordinates_replaced = 0;  // of t, not finite or beyond 1e6 mm: taken from the mean instead
    std::uint16_t weights_clamped = 0;
};

// pack.solver == SolverKind::kRbf. positions_mm: t [3m], face frame, every marker given (inferred where not
// seen). weights: [N], always finite and inside the pack's ranges. Bounded work: d 3m + K d + K N
// multiplications.
[[nodiscard]] RbfReport evaluate_rbf(const SolvePack& pack, std::span<const float> positions_mm,
                                     RbfWorkspace& workspace, std::span<double> weights);

}  // namespace rig
