// Radial basis function regression from marker positions to weights [Deng06 eq. 3-6]:
//
//   x = E (t - mean)                    E [d x 3m] orthonormal rows: the principal axes of the training
//   u_k = |x - c_k|^2 / s_k^2           c_k the reference frames, s_k their widths
//   h_k = phi(u_k)                      Gaussian (the source's), thin plate or multiquadric: solve_pack.hpp
//   w = W^T h + offset, clamped         clamping into [low, high] is ours
//
// Evaluation only: training is the host's (firmware_host/companion/train). It interpolates between its
// references and knows nothing beyond them, so how far a face is from the nearest one is part of the report,
// and with it how much of the answer should be another solver's.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/pack/solve_pack.hpp"

namespace rig {

// The pack's numbers as the loops want them, padded with zeros to whole vectors; built once.
struct RbfTables {
    RbfKernel kernel = RbfKernel::kGaussian;
    float hull_near_widths = 0.0F;
    float hull_far_widths = 0.0F;
    std::size_t rows = 0;        // 3m
    std::size_t dimensions = 0;  // d
    std::size_t centres = 0;     // K
    std::size_t shapes = 0;      // N
    alignas(64) std::array<float, kMaxRows> mean_mm{};
    alignas(64) std::array<float, kMaxRbfDimensions * kMaxRows> basis{};  // E, rows padded(3m) apart
    alignas(
        64) std::array<float, kMaxRbfDimensions * kMaxRbfCentres> centres_mm{};  // [d x K], padded(K) apart
    alignas(64) std::array<float, kMaxRbfCentres> inverse_square_width{};        // 1 / s_k^2
    alignas(64) std::array<float, kMaxRbfCentres * kMaxShapes> weights{};        // W, rows padded(N) apart
    alignas(64) std::array<float, kMaxShapes> offset{};
    alignas(64) std::array<float, kMaxShapes> low{};
    alignas(64) std::array<float, kMaxShapes> high{};
};

struct RbfWorkspace {
    alignas(64) std::array<float, kMaxRows> motion_mm{};          // t - mean
    alignas(64) std::array<float, kMaxRbfDimensions> point_mm{};  // x
    alignas(64) std::array<float, kMaxRbfCentres> squared{};      // u
    alignas(64) std::array<float, kMaxRbfCentres> heights{};      // h
    alignas(64) std::array<float, kMaxShapes> weights{};          // w
};

struct RbfReport {
    std::uint16_t nearest_centre = 0;
    // min_k |x - c_k| / s_k: under about 2 the references speak; beyond 3 every Gaussian height is under
    // 0.011 and the answer is mostly the offset.
    float nearest_widths = 0.0F;
    // 0 inside, 1 far outside, after hull_share(): how much of the answer should be the box QP's.
    float hull_share = 0.0F;
    std::uint16_t coordinates_replaced = 0;  // of t, not finite or beyond 1e6 mm: taken from the mean instead
    std::uint16_t weights_clamped = 0;
};

// Not for frames. pack.solver == SolverKind::kRbf.
void build_rbf_tables(const SolvePack& pack, RbfTables& tables);

// 0 up to `near`, 1 from `far` on, between them 3 s^2 - 2 s^3 of the way s: rising, without a corner at
// either end. 0 everywhere when far is 0.
[[nodiscard]] float hull_share(float distance_widths, float near_widths, float far_widths);

// positions_mm: t [3m], face frame, every marker given (inferred where not seen). weights: [N], always finite
// and inside the pack's ranges. Single precision; bounded work: 3m d + 2 d K + K N multiplications and K
// exponentials, logarithms or square roots.
[[nodiscard]] RbfReport evaluate_rbf(const RbfTables& tables, std::span<const float> positions_mm,
                                     RbfWorkspace& workspace, std::span<float> weights);

}  // namespace rig
