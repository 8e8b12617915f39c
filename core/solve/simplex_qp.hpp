// The convex combination of examples that comes nearest to what was measured [Zhang06 eq. 1-5]:
//
//   minimise (g - G c)^T V (g - G c)   subject to   sum_i c_i = 1,  c >= 0
//
//   G  [R x n] the examples less their mean, row-major, rows `stride` apart, padded with zeros
//   g  [R] what was measured, less the same mean
//   V  = diag(row_weight), >= 0; 0: the row is hidden
//
// Because the coefficients sum to 1, taking the mean example from both sides changes the size of the numbers
// and nothing else; without it the Gram matrix holds the squared positions, of which float keeps too little.
// For the same reason G^T V G + shift 1 1^T has the same minimum for every shift.
//
// An exact active set: exchanges of several examples at once, in float; where those do not end, or examples
// depend on each other, the walk in double of simplex_walk.hpp. What is returned is feasible wherever it
// stops; the optimal value does not depend on the start, and neither do the coefficients unless examples
// depend on each other. The explicit inverse over the examples in use is kept from frame to frame, spread out
// over all n rows and columns (zero where an example is not in use): a change of the working set is one
// rank-one update without any moving of rows.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/float_kernels.hpp"
#include "core/limits.hpp"
#include "core/solve/simplex_walk.hpp"

namespace rig {

inline constexpr std::size_t kSimplexStride = padded(kMaxRegionShapes);

// Measured coordinates beyond this (a thousand faces away) count as hidden, as those that are not finite do.
inline constexpr float kMaxSimplexTarget = 1e6F;

struct SimplexQpProblem {
    std::size_t rows = 0;               // R, 1..kMaxRows
    std::size_t count = 0;              // n, 1..kMaxRegionShapes
    std::size_t stride = 0;             // padded(n)
    std::span<const float> examples;    // G [R x stride]
    std::span<const float> gram;        // G^T G [n x stride], of build_simplex_gram()
    std::span<const float> target;      // g [R], any numbers
    std::span<const float> row_weight;  // diagonal of V [R], finite, >= 0; empty: all 1
    // What was computed for one G may be kept as long as this stays the same.
    std::uint32_t version = 0;
};

struct SimplexQpConfig {
    std::uint16_t iteration_cap = 8 * kMaxRegionShapes;
    // Largest move of a projected Jacobi step at which a point counts as optimal, relative to 1 or to the
    // distance of g in units of the examples' size.
    float tolerance = 2e-6F;
};

// Kept from frame to frame; a default-constructed one starts cold, at the nearest single example.
struct SimplexQpState {
    bool warm = false;
    bool all_rows = true;  // gram of the problem, or of `gram` below
    std::uint32_t version = 0;
    std::uint16_t count = 0;
    std::uint16_t rows = 0;
    std::uint16_t changes_since_rebuild = 0;
    bool has_inverse = false;
    float shift = 0.0F;
    std::uint32_t used = 0;                                            // one bit an example
    std::uint32_t settled = 0;                                         // those in use at the coefficients
    alignas(64) std::array<float, kSimplexStride> used_lane{};         // the same as 1 and 0
    alignas(64) std::array<float, kSimplexStride> coefficients{};      // the last answer
    alignas(64) std::array<float, kSimplexStride> inverse_diagonal{};  // 1 / (Gram_ii + shift)
    alignas(64) std::array<float, kSimplexStride> inverse_sums{};      // inverse 1
    alignas(64) std::array<float, kMaxRegionShapes * kSimplexStride> inverse{};  // [n x stride]
    alignas(64) std::array<float, kMaxRegionShapes * kSimplexStride> gram{};     // G^T V G, when V != I
    std::array<float, kMaxRows> row_weight{};                                    // of that V
    SimplexWalkState walk;
};

struct SimplexQpWorkspace {
    alignas(64) std::array<float, kSimplexStride> linear{};  // G^T V g
    alignas(64) std::array<float, kSimplexStride> pull{};    // G^T V (g - G c), minus half the gradient
    alignas(64) std::array<float, kSimplexStride> move{};    // of a Jacobi step
    alignas(64) std::array<float, kSimplexStride> point{};   // from which the next aim is taken
    alignas(64) std::array<float, kSimplexStride> aim{};     // minimum of the face
    alignas(64) std::array<float, kSimplexStride> column{};  // of the update
    alignas(64) std::array<float, kSimplexStride> projection{};
    std::array<float, kMaxRows> weighted{};  // V g
    SimplexWalkWorkspace walk;
};

struct SimplexQpReport {
    std::uint16_t iterations = 0;  // faces solved
    std::uint16_t changes = 0;     // of the working set
    std::uint16_t rebuilds = 0;    // of the inverse, from nothing
    std::uint16_t rows_used = 0;
    // max_i |c_i - max(0, c_i + (pull_i - lambda) / (Gram_ii + shift))|, lambda the multiplier of sum c = 1
    float kkt = 0.0F;
    float objective = 0.0F;  // 1/2 c^T G^T V G c - c^T G^T V g: half the problem's, less a constant
    float gap = 0.0F;        // the objective is above the optimum by no more than this, up to rounding
    bool walked = false;     // finished by the walk in double
    bool optimal = false;    // false: stopped at the cap, or kkt stayed above the tolerance
};

// gram := G^T diag(row_weight) G [n x stride], zeros in the padding; an empty row_weight is all 1. Rows of
// weight 0 are left out. Once per pack, and inside a solve when V has changed.
void build_simplex_gram(std::span<const float> examples, std::size_t rows, std::size_t count,
                        std::span<const float> row_weight, std::span<float> gram);

// c [n]: >= 0 and summing to 1 within 1e-6 for any target and examples, finite always. With no row seen the
// last answer stays. Bounded work: iteration_cap steps of at most six products with an n x n matrix.
[[nodiscard]] SimplexQpReport solve_simplex_qp(const SimplexQpProblem& problem, const SimplexQpConfig& config,
                                               SimplexQpState& state, SimplexQpWorkspace& workspace,
                                               std::span<float> c);

}  // namespace rig
