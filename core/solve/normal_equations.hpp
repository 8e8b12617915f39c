// Turns named markers in the face frame into the quadratic every linear solver minimises:
//
//   E(w) = sum_k (b0_k + B_k w - t_k)^T V_k (b0_k + B_k w - t_k) + beta |w|_1 + eps |w|^2 + sum_i gamma_i
//   (w_i - p_i)^2
//        = 2 (1/2 w^T H w + q^T w) + constant                                          [Hybrid16 eq. 3-4]
//   H = B^T V B + diag(eps + gamma),   q = B^T V (b0 - t) + beta/2 - gamma p
//
// beta |w| is linear, and here only, where a shape's range does not go below 0; other shapes have none of it.
// V_k = s^2 A_k: A_k the marker's information, s the pack's noise; so V = I for an ordinary 3D marker and E
// is in mm^2. H follows from frame to frame by the rank-one terms of the markers that came, went or are seen
// anew; so does the inverse that the box QP keeps. Real is float or double, as the box QP's.
#pragma once

#include <array>
#include <span>

#include "core/base/float_kernels.hpp"
#include "core/base/linalg.hpp"
#include "core/limits.hpp"
#include "core/pack/solve_pack.hpp"
#include "core/solve/box_qp.hpp"

namespace rig {

inline constexpr std::size_t kMaxShapeStride = row_stride(kMaxShapes);

// What the pack lets us compute before the first frame. Rows row_stride(N) apart, padded with zeros.
template <typename Real>
struct NormalTables {
    alignas(64) std::array<Real, kMaxRows * kMaxShapeStride> basis_mm{};     // B
    alignas(64) std::array<Real, kMaxShapes * kMaxShapeStride> full_gram{};  // B^T B
};

template <typename Real>
void build_normal_tables(const SolvePack& pack, NormalTables<Real>& tables);

struct NormalInput {
    std::span<const Vec3> positions_mm;  // t, face frame [m]
    std::span<const Mat3> weights;       // V [m]; zero: not seen
    std::span<const double> previous;    // p [N]
    double gamma_scale = 0.0;  // 1 / frames since p; 0 when there is no p (first frame, after a loss)
};

// H and what it was made of.
template <typename Real>
struct NormalState {
    bool valid = false;          // false: the next frame makes H anew
    std::uint32_t version = 0;   // changes when H does
    std::uint16_t followed = 0;  // rank-one terms since H was made: their rounding adds up
    double gamma_scale = 0.0;
    std::array<Mat3, kMaxMarkers>
        weights{};  // V that H was made with, within kSameInformation of the input's
    alignas(64) std::array<Real, kMaxShapes * kMaxShapeStride> hessian{};  // H, rows row_stride(N) apart
    std::array<Real, kMaxShapes> regularisation{};                         // H - B^T V B, a diagonal
};

template <typename Real>
struct NormalEquations {
    alignas(64) std::array<Real, kMaxShapeStride> linear{};  // q
    alignas(64) std::array<Real, kMaxShapeStride> term{};    // scratch: one row of L^T B_k
    std::array<Real, kMaxRows> error{};                      // scratch: V (b0 - t) of the seen rows
    std::array<std::uint16_t, kMaxRows> rows{};              // scratch: which rows
    double constant_mm2 = 0.0;                               // E(0)
    std::size_t markers_used = 0;
    bool changed = false;  // H or V is not the last frame's
};

// V that differs by less than this share of its trace counts as the same: a ray turns by less while a marker
// moves about its place.
inline constexpr double kSameInformation = 0.05;

// Makes H follow the input's V, and with it the inverse in `qp`; then q. pack, tables: as built.
template <typename Real>
void build_normal_equations(const SolvePack& pack, const NormalTables<Real>& tables, const NormalInput& input,
                            NormalState<Real>& state, BoxQpState<Real>& qp, NormalEquations<Real>& equations);

// Root mean square over the measured coordinates of (b0 + B w - t), mm; coordinates count by the trace of V.
// w [padded(N)], zeros behind N.
template <typename Real>
[[nodiscard]] double residual_rms_mm(const SolvePack& pack, const NormalTables<Real>& tables,
                                     const NormalInput& input, std::span<const Real> w);

}  // namespace rig
