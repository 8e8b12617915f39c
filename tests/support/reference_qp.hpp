// Slow, plain solutions of small box-constrained quadratic programmes in long double, to hold core's solver
// against.
#pragma once

#include <vector>

namespace rig::test {

// Minimise 1/2 w^T H w + q^T w, low <= w <= high (either may be infinite).
struct ReferenceQp {
    std::size_t size = 0;
    std::vector<long double> hessian;  // [N x N]
    std::vector<long double> linear;
    std::vector<long double> low;
    std::vector<long double> high;

    [[nodiscard]] long double objective(const std::vector<long double>& w) const;
    [[nodiscard]] std::vector<long double> gradient(const std::vector<long double>& w) const;
};

// Tries every assignment of low / free / high to the variables (3^N systems); N <= 8. H positive definite.
[[nodiscard]] std::vector<long double> solve_exhaustively(const ReferenceQp& problem);

// Cyclic projected coordinate descent until no coordinate moves by more than `tolerance`, or `sweeps` are
// done.
[[nodiscard]] std::vector<long double> solve_by_descent(const ReferenceQp& problem, long double tolerance,
                                                        int sweeps);

}  // namespace rig::test
