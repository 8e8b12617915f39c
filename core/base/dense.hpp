// Dense kernels of the solvers: row-major double matrices in caller's memory, fixed summation order, no
// allocation. Not a general linear algebra library: exactly what normal equations and symmetric factors need.
#pragma once

#include <cstddef>

namespace rig {

// Sum of a[i] b[i], in four interleaved partial sums added as ((s0 + s1) + (s2 + s3)): the same bits
// everywhere.
[[nodiscard]] double dot(const double* a, const double* b, std::size_t n);
[[nodiscard]] double dot(const float* a, const double* b, std::size_t n);

// y += alpha x
void add_scaled(double* y, double alpha, const double* x, std::size_t n);

// Lower Cholesky factor of the symmetric n x n matrix `a` (its lower triangle is read) into `l` (lower
// triangle written; may be `a` itself). Rows are `stride` apart. False when a pivot is not above `floor`
// times the largest diagonal entry of `a`: the matrix is not positive definite to working precision.
[[nodiscard]] bool cholesky(const double* a, double* l, std::size_t n, std::size_t stride,
                            double floor = 1e-14);

// x := L^-1 x and x := L^-T x.
void solve_lower(const double* l, std::size_t n, std::size_t stride, double* x);
void solve_lower_transposed(const double* l, std::size_t n, std::size_t stride, double* x);

// (L L^T)^-1 into `inverse`, whole and symmetric, rows `stride` apart and zero behind column n. l is not
// `inverse`; stride is at least padded(n) (float_kernels.hpp); scratch holds n doubles. n^3 / 2 operations.
void symmetric_inverse(const double* l, std::size_t n, std::size_t stride, double* inverse, double* scratch);

// Rows [first, last) of L^T, a = L L^T symmetric and positive definite, n x n (its upper triangle is read),
// in the place of a's; the rows above `first` hold L^T already. Rows are `stride` apart, stride at least n +
// kLaneFloats, zeros in [n, n + kLaneFloats); scratch holds n doubles. False as cholesky(), by the largest
// diagonal entry of the rows at hand.
[[nodiscard]] bool upper_factor(double* a, std::size_t first, std::size_t last, std::size_t n,
                                std::size_t stride, double* scratch, double floor = 1e-14);

// L^-1 of a = L L^T, symmetric and positive definite: `a` (its upper triangle is read) becomes L^T, and
// `inverse` the lower triangle of L^-1 with zeros to its right, up to padded(n). Rows of both are `stride`
// apart, stride at least n + kLaneFloats; scratch holds n doubles. n^3 / 3 operations, all in wide rows.
// False as cholesky().
[[nodiscard]] bool inverse_of_factor(double* a, std::size_t n, std::size_t stride, double* inverse,
                                     double* scratch, double floor = 1e-14);

// Eigenvalues (falling) and eigenvectors (column j of `vectors` belongs to values[j]) of the symmetric n x n
// matrix `a`, which is destroyed. Cyclic Jacobi, at most 30 sweeps. For set-up, not for frames: about 10 n^3
// operations.
void symmetric_eigen(double* a, std::size_t n, std::size_t stride, double* values, double* vectors);

}  // namespace rig
