// Turns named markers in the face frame into the quadratic every linear solver minimises:
//
//   E(w) = sum_k (b0_k + B_k w - t_k)^T V_k (b0_k + B_k w - t_k) + beta |w|_1 + eps |w|^2 + sum_i gamma_i
//   (w_i - p_i)^2
//        = 2 (1/2 w^T H w + q^T w) + constant                                          [Hybrid16 eq. 3-4]
//   H = B^T V B + diag(eps + gamma),   q = B^T V (b0 - t) + beta/2 1 - gamma p         (for w >= 0)
//
// V_k = s^2 A_k: A_k the marker's information, s the pack's noise; so V = I for an ordinary 3D marker and E
// is in mm^2.
#pragma once

#include <array>
#include <span>

#include "core/base/linalg.hpp"
#include "core/limits.hpp"
#include "core/pack/solve_pack.hpp"

namespace rig {

// What the pack lets us compute before the first frame.
struct NormalTables {
    std::array<double, kMaxRows * kMaxShapes> basis_mm{};     // B, rows kMaxShapes apart
    std::array<double, kMaxShapes * kMaxShapes> full_gram{};  // B^T B, rows kMaxShapes apart
};

void build_normal_tables(const SolvePack& pack, NormalTables& tables);

struct NormalInput {
    std::span<const Vec3> positions_mm;  // t, face frame [m]
    std::span<const Mat3> weights;       // V [m]; zero: not seen
    std::span<const double> previous;    // p [N]
    double gamma_scale = 0.0;  // 1 / frames since p; 0 when there is no p (first frame, after a loss)
};

struct NormalEquations {
    std::array<double, kMaxShapes * kMaxShapes> hessian{};  // H, rows kMaxShapes apart
    std::array<double, kMaxShapes> linear{};                // q
    std::array<double, kMaxShapes> data_diagonal{};         // of B^T V B alone
    double constant_mm2 = 0.0;                              // E(0)
    std::size_t markers_used = 0;
};

void build_normal_equations(const SolvePack& pack, const NormalTables& tables, const NormalInput& input,
                            NormalEquations& equations);

// Root mean square over the measured coordinates of (b0 + B w - t), mm; coordinates count by the trace of V.
[[nodiscard]] double residual_rms_mm(const SolvePack& pack, const NormalTables& tables,
                                     const NormalInput& input, std::span<const double> w);

}  // namespace rig
