// Slow, plain solutions of small simplex-constrained least squares in long double, to hold core's solver
// against.
#pragma once

#include <span>
#include <vector>

namespace rig::test {

// Minimise 1/2 (g - G c)^T V (g - G c) subject to sum c = 1, c >= 0, from the examples themselves: no Gram
// matrix.
struct ReferenceSimplexQp {
    std::size_t rows = 0;
    std::size_t count = 0;
    std::vector<long double> examples;  // G [R x n]
    std::vector<long double> target;    // g [R]
    std::vector<long double> weight;    // diagonal of V [R]

    [[nodiscard]] long double objective(std::span<const long double> c) const;
    // Of the objective with respect to c [n].
    [[nodiscard]] std::vector<long double> gradient(std::span<const long double> c) const;
};

// Tries every set of examples in use (2^n bordered systems); n <= 10 and no example an affine combination of
// others.
[[nodiscard]] std::vector<long double> solve_exhaustively(const ReferenceSimplexQp& problem);

// Moves weight from the example with the largest gradient in use to that with the least, exactly, until the
// duality gap is under `gap` or `moves` are done. Any examples.
[[nodiscard]] std::vector<long double> solve_by_pairs(const ReferenceSimplexQp& problem, long double gap,
                                                      int moves);

}  // namespace rig::test
