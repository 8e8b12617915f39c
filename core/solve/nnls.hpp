// Non-negative least squares of a small dense problem from its normal equations [Chuang02 eq. 4]:
//
//   minimise 1/2 w^T H w - b^T w   subject to   w >= 0,      H = S^T V S,  b = S^T V t
//
//   H  [n x n] symmetric positive semidefinite, rows `stride` apart
//
// The box QP with low = 0 and high = infinity, behind a seam of its own: which arithmetic that solver uses is
// seen here and nowhere else. Where key shapes depend on each other (duplicates, more of them than rows) the
// least tilt on the diagonal makes the answer unique: close to the one of least norm, at an objective that is
// higher by no more than the tilt times |w|^2 / 2.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/limits.hpp"
#include "core/solve/box_qp.hpp"

namespace rig {

inline constexpr double kNnlsTilt = 1e-9;  // of H's largest diagonal entry

struct NnlsProblem {
    std::size_t count = 0;   // n, 1..kMaxRegionShapes
    std::size_t stride = 0;  // >= n
    std::span<const double> hessian;
    std::span<const double> linear;  // b [n]
};

struct NnlsState {
    BoxQpState box;
    std::array<double, kMaxRegionShapes> weights{};  // the last answer
    std::uint16_t count = 0;
};

struct NnlsWorkspace {
    std::array<double, kMaxRegionShapes * kMaxShapes> hessian{};
    std::array<double, kMaxRegionShapes> linear{};
    std::array<double, kMaxRegionShapes> low{};
    std::array<double, kMaxRegionShapes> high{};
};

// w [n]: finite and >= 0 always. The report is that of the tilted problem.
[[nodiscard]] BoxQpReport solve_nnls(const NnlsProblem& problem, NnlsState& state, NnlsWorkspace& workspace,
                                     BoxQpWorkspace& box_workspace, std::span<double> w);

}  // namespace rig
