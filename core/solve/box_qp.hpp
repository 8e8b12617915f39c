// Minimise 1/2 w^T H w + q^T w subject to low <= w <= high, exactly, by a primal active-set method that keeps
// the inverse of the free block from frame to frame.
//
//   H  [N x N] symmetric positive semidefinite, row-major, rows `stride` apart, padded with zeros
//   q  [N]
//   low, high [N], low <= high; either may be infinite
//
// Every iterate is feasible and no worse than the one before, so stopping at the cap still returns a usable
// answer. Where H is positive definite the optimum is unique and the answer does not depend on the start
// beyond rounding; where it is not, the objective does not. [Hybrid16 eq. 3] is this problem; non-negative
// least squares [Chuang02 eq. 4] is its special case low = 0, high = infinity.
//
// A frame differs from the one before by a few variables that reach or leave a bound. Each such change costs
// one rank-one update of the k x k inverse (k^2 multiply-adds, half of that where several are made together)
// and, when a variable comes, one product with it; each face of the box that is solved one product and one
// gradient (k^2 + k N). Real is float for problems with a ridge or a temporal pull of
// at least 1e-4 of H's mean diagonal, double for those without: float's inverse wears out on them.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/float_kernels.hpp"
#include "core/limits.hpp"

namespace rig {

template <typename Real>
struct BoxQpProblem {
    std::size_t size = 0;           // N, 1..kMaxUnknowns
    std::size_t stride = 0;         // >= padded(N), a multiple of kLaneFloats; row_stride(N) is the quickest
    std::span<const Real> hessian;  // H [N x stride]; columns N..padded(N) zero
    std::span<const Real> linear;   // q [N]
    std::span<const Real> low;      // [N]
    std::span<const Real> high;     // [N]
    std::uint32_t hessian_version = 0;  // changes when H does: what the state holds of the old H is made anew
};

struct BoxQpConfig {
    std::uint16_t iteration_cap = 8 * kMaxUnknowns;
    // A point counts as optimal when a projected Jacobi step moves no variable by more than this, relative to
    // the largest |w_i|, or to 1 (float) or 0.01 (double) when all are smaller.
    double tolerance = 1e-6;
};

// Which variables sit at a bound, and the inverse of H over the others; kept from frame to frame.
template <typename Real>
struct BoxQpState {
    static constexpr std::size_t kInverseStride = row_stride(kMaxUnknowns);
    // kHeld: between its bounds, but not among the free ones because its column depends on theirs.
    enum class Where : std::uint8_t { kFree = 0, kLow = 1, kHigh = 2, kHeld = 3 };

    bool warm = false;  // false: the next solve starts from its weights alone
    bool inverse_valid = false;
    bool settled = false;     // what is kept below belongs to `answer` in these bounds
    std::uint8_t spared = 0;  // solves to come in which the inverse is not made anew for sharpness
    std::uint32_t hessian_version = 0;
    std::uint16_t size = 0;          // N
    std::uint16_t free_count = 0;    // k
    std::uint16_t pinned_count = 0;  // variables that are not free and not zero
    std::array<Where, kMaxUnknowns> where{};
    std::array<std::uint16_t, kMaxUnknowns> free{};        // [k], in the order of the inverse's rows
    std::array<std::uint16_t, kMaxUnknowns> pinned{};      // in no order
    alignas(64) std::array<Real, kMaxUnknowns> answer{};   // w of the last solve
    alignas(64) std::array<Real, kMaxUnknowns> product{};  // H answer
    alignas(64) std::array<Real, kMaxUnknowns> scale{};    // 1 / H_ii
    alignas(64) std::array<Real, kMaxUnknowns> low{};
    alignas(64) std::array<Real, kMaxUnknowns> high{};
    // What a multiplier counts for: 1 / sqrt(share of H_ii that the free ones left when i last came or went).
    alignas(64) std::array<Real, kMaxUnknowns> price{};
    alignas(64) std::array<Real, kMaxUnknowns> open{};  // 1 where the variable may be freed, else 0
    // Of the free variables, in the order of the inverse's rows; zeros beyond.
    alignas(64) std::array<Real, kMaxUnknowns> value{};
    alignas(64) std::array<Real, kMaxUnknowns> free_low{};
    alignas(64) std::array<Real, kMaxUnknowns> free_high{};
    alignas(64) std::array<Real, kMaxUnknowns> free_scale{};
    alignas(64) std::array<Real, kMaxUnknowns * kInverseStride> inverse{};  // [k x k], zeros beyond
};

inline constexpr std::size_t kBoxQpPending = 8;  // changes of the inverse that wait to be made together

template <typename Real>
struct BoxQpWorkspace {
    alignas(64) std::array<Real, kMaxUnknowns> gradient{};       // H w + q
    alignas(64) std::array<Real, kMaxUnknowns> free_gradient{};  // [k], as the inverse's rows
    alignas(64) std::array<Real, kMaxUnknowns> step{};           // [k] inverse free_gradient
    alignas(64) std::array<Real, kMaxUnknowns> moves{};          // of a projected Jacobi step
    alignas(64) std::array<Real, kMaxUnknowns> column{};
    alignas(64) std::array<Real, kMaxUnknowns> direction{};
    alignas(64) std::array<Real, kMaxUnknowns> moving{};
    // During a solve the inverse is the state's and sum_j sign[j] u_j u_j^T of the changes that wait.
    alignas(64) std::array<Real, kBoxQpPending * BoxQpState<Real>::kInverseStride> pending{};
    std::array<Real, kBoxQpPending> sign{};
    std::array<Real, kBoxQpPending> share{};
    std::array<std::uint16_t, kMaxUnknowns> index{};
    std::array<std::uint16_t, kMaxUnknowns> candidates{};
};

struct BoxQpReport {
    std::uint16_t iterations = 0;  // steps taken
    std::uint16_t changes = 0;     // of the working set
    std::uint16_t rebuilds = 0;    // of the inverse, from nothing
    std::uint64_t work = 0;        // multiply-adds of passes over H and the inverse
    double kkt = 0.0;  // max_i |w_i - clamp(w_i - g_i / H_ii)|: the projected Jacobi step's largest move
    double objective = 0.0;  // 1/2 w^T H w + q^T w
    bool optimal = false;    // kkt within ten tolerances; false: stopped at the cap, or worn out
};

// A solve begins no further step once it has done this many multiply-adds,
[[nodiscard]] constexpr std::uint64_t box_qp_work_budget(std::uint64_t n) {
    return (n + 1) * (n + 1) * (2 * (n + 1) + 512);
}
// and never does more than this: the last step may free sixteen variables and make the inverse anew.
[[nodiscard]] constexpr std::uint64_t box_qp_work_cap(std::uint64_t n) {
    return box_qp_work_budget(n) + (n + 1) * (n + 1) * (n + 1 + 64);
}

// On entry `w` holds a start (any numbers; clamped), on return the answer, finite and inside the bounds for
// finite H and q. Bounded: iteration_cap steps and box_qp_work_cap(N) multiply-adds.
[[nodiscard]] BoxQpReport solve_box_qp(const BoxQpProblem<float>& problem, const BoxQpConfig& config,
                                       BoxQpState<float>& state, BoxQpWorkspace<float>& workspace,
                                       std::span<float> w);
[[nodiscard]] BoxQpReport solve_box_qp(const BoxQpProblem<double>& problem, const BoxQpConfig& config,
                                       BoxQpState<double>& state, BoxQpWorkspace<double>& workspace,
                                       std::span<double> w);

// H := H + z z^T (or H - z z^T): the state's inverse follows, z [N] (Sherman and Morrison). False when it
// cannot, and the next solve makes it anew. After the last term, settle_hessian() names the new H.
bool follow_hessian(BoxQpState<float>& state, std::span<const float> z, bool add);
bool follow_hessian(BoxQpState<double>& state, std::span<const double> z, bool add);
void settle_hessian(BoxQpState<float>& state, std::span<const float> hessian, std::size_t stride,
                    std::uint32_t version);
void settle_hessian(BoxQpState<double>& state, std::span<const double> hessian, std::size_t stride,
                    std::uint32_t version);

}  // namespace rig
