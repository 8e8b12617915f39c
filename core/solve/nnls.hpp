// Non-negative least squares of a small dense problem from its normal equations [Chuang02 eq. 4]:
//
//   minimise 1/2 w^T H w - b^T w   subject to   w >= 0,      H = S^T V S,  b = S^T V t
//
//   H  [n x n] symmetric positive semidefinite, rows `stride` apart
//
// The box QP in double with low = 0 and high = infinity. It starts from the weights of the frame before; the
// inverse over the few in use is made anew, which costs less than keeping one a region.
//
// Key shapes may depend on each other (duplicates, empty ones, more of them than rows), and absolute
// positions nearly do. So H is tilted to H + tilt I, and the tilt is taken back by proximal steps: each
// minimises
//   1/2 w^T H w - b^T w + tilt/2 |w - c|^2,   w >= 0,   c the minimum before, at first 0
// until the problem itself is solved. Along what the data does not tell, the weights stay near least norm.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/limits.hpp"
#include "core/solve/box_qp.hpp"

namespace rig {

inline constexpr double kNnlsTilt = 1e-7;       // of H's largest diagonal entry
inline constexpr double kNnlsTolerance = 1e-9;  // largest Jacobi move, relative to the largest weight

struct NnlsProblem {
    std::size_t count = 0;   // n, 1..kMaxRegionShapes
    std::size_t stride = 0;  // >= n
    std::span<const double> hessian;
    std::span<const double> linear;  // b [n]
};

struct NnlsState {
    std::array<double, kMaxRegionShapes> weights{};  // the last answer
    std::uint16_t count = 0;
};

struct NnlsWorkspace {
    alignas(64) std::array<double, kMaxRegionShapes * row_stride(kMaxRegionShapes)> hessian{};
    std::array<double, kMaxRegionShapes> linear{};
    std::array<double, kMaxRegionShapes> centre{};
    std::array<double, kMaxRegionShapes> low{};
    std::array<double, kMaxRegionShapes> high{};
    BoxQpState<double> box;
    BoxQpWorkspace<double> box_workspace;
};

// w [n]: finite and >= 0 always. The certificate is that of the problem itself; iterations are those of all
// rounds. Bounded: at most 8 rounds.
[[nodiscard]] BoxQpReport solve_nnls(const NnlsProblem& problem, NnlsState& state, NnlsWorkspace& workspace,
                                     std::span<double> w);

}  // namespace rig
