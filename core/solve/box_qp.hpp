// Minimise 1/2 w^T H w + q^T w subject to low <= w <= high, exactly, by a primal active-set method.
//
//   H  [N x N] symmetric positive definite, row-major, rows kMaxShapes apart
//   q  [N]
//   low, high [N], low <= high; either may be infinite
//
// Every iterate is feasible and no worse than the one before, so stopping at the cap still returns a usable
// answer. The answer does not depend on the start beyond rounding: H is positive definite, so the optimum is
// unique. [Hybrid16 eq. 3] is this problem; non-negative least squares [Chuang02 eq. 4] is its special case
// high = infinity.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/limits.hpp"

namespace rig {

struct BoxQpProblem {
    std::size_t size = 0;             // N
    std::span<const double> hessian;  // H
    std::span<const double> linear;   // q
    std::span<const double> low;      // [N]
    std::span<const double> high;     // [N]
};

struct BoxQpConfig {
    std::uint16_t iteration_cap = 4 * kMaxShapes + 16;
    double kkt_tolerance =
        1e-9;  // largest move of a projected Jacobi step at which a point counts as optimal
};

// Which variables sit at a bound; kept from frame to frame as the warm start.
struct BoxQpState {
    enum class Where : std::uint8_t { kFree = 0, kLow = 1, kHigh = 2 };
    std::array<Where, kMaxShapes> where{};
    bool warm = false;  // false: the next solve starts with everything free
};

struct BoxQpWorkspace {
    std::array<double, kMaxShapes * kMaxShapes> factor{};
    std::array<double, kMaxShapes> step{};
    std::array<double, kMaxShapes> gradient{};
    std::array<std::uint16_t, kMaxShapes> free{};
};

struct BoxQpReport {
    std::uint16_t iterations = 0;
    double kkt = 0.0;  // max_i |w_i - clamp(w_i - g_i / H_ii)|: the projected Jacobi step's largest move
    double objective = 0.0;  // 1/2 w^T H w + q^T w
    bool optimal = false;    // false: capped, or H was not positive definite on the free variables
};

// On entry `w` holds a start (any finite numbers; clamped), on return the answer. Bounded work: iteration_cap
// times one Cholesky factor of the free variables.
[[nodiscard]] BoxQpReport solve_box_qp(const BoxQpProblem& problem, const BoxQpConfig& config,
                                       BoxQpState& state, BoxQpWorkspace& workspace, std::span<double> w);

}  // namespace rig
