// Dense kernels of the solvers over padded rows, in float or double. Every output element is summed in the
// order of its terms, so the bits depend neither on the width of the machine's vectors nor on the compiler;
// reductions keep 16 partial sums and add them in a fixed tree. No contraction: core's targets are built with
// -ffp-contract=off. What does not fit padded rows: dense.hpp.
#pragma once

#include <cstddef>
#include <cstdint>

namespace rig {

inline constexpr std::size_t kLaneFloats = 16;  // rows are padded with zeros to a multiple of this

[[nodiscard]] constexpr std::size_t padded(std::size_t n) {
    return (n + kLaneFloats - 1) / kLaneFloats * kLaneFloats;
}

// Distance of rows of n elements: an odd number of lanes, so that rows do not fight for the same cache sets.
[[nodiscard]] constexpr std::size_t row_stride(std::size_t n) {
    return padded(n) / kLaneFloats % 2 == 1 ? padded(n) : padded(n) + kLaneFloats;
}

// out[c] = start[c] + sum_r coefficient[r] row_r[c], c in [0, n); row_r begins at rows + r stride.
// Rows hold zeros from n to padded(n) and `out` has room for padded(n), of which what lies behind n may or
// may not be written; `start` may be null (zero) or `out` itself; nothing else may overlap.
void combine_rows(const float* rows, std::size_t stride, const float* coefficient, std::size_t count,
                  std::size_t n, const float* start, float* out);
void combine_rows(const double* rows, std::size_t stride, const double* coefficient, std::size_t count,
                  std::size_t n, const double* start, double* out);

// The same over the rows index[0, count) only.
void combine_rows(const float* rows, std::size_t stride, const std::uint16_t* index, const float* coefficient,
                  std::size_t count, std::size_t n, const float* start, float* out);
void combine_rows(const double* rows, std::size_t stride, const std::uint16_t* index,
                  const double* coefficient, std::size_t count, std::size_t n, const double* start,
                  double* out);

// Sum of a[i] b[i] over [0, n), n a multiple of kLaneFloats.
[[nodiscard]] float padded_dot(const float* a, const float* b, std::size_t n);
[[nodiscard]] double padded_dot(const double* a, const double* b, std::size_t n);

// The symmetric k x k matrix m := m + u u^T (or m - u u^T), rows `stride` apart, u zero from k to padded(k);
// stays exactly symmetric.
void add_square(float* m, std::size_t stride, std::size_t k, const float* u);
void add_square(double* m, std::size_t stride, std::size_t k, const double* u);
void subtract_square(float* m, std::size_t stride, std::size_t k, const float* u);
void subtract_square(double* m, std::size_t stride, std::size_t k, const double* u);

// m := m + sum_j sign[j] u_j u_j^T in one pass, sign[j] = 1 or -1, `count` terms in order; u_j begins at
// vectors + j stride, each zero from k to padded(k). m is symmetric, stays exactly so, and has padded(k) rows
// of padded(k), zeros behind k.
void add_squares(float* m, std::size_t stride, std::size_t k, const float* vectors, const float* sign,
                 std::size_t count);
void add_squares(double* m, std::size_t stride, std::size_t k, const double* vectors, const double* sign,
                 std::size_t count);

// Triples of floats, number i at first + i stride.
struct Triples {
    const float* first;
    std::size_t stride;
};

// Rows [begin, end) of the upper triangle of m: row_i += t0 v_0 + t1 v_1 + t2 v_2 in this order, t the triple
// i - begin, v_0 .. v_2 the rows of `vectors`; m and vectors have rows `stride` apart, zeros from `size` on.
// What lies left of the diagonal is spoilt.
void add_triple(float* m, std::size_t stride, const Triples& triples, std::size_t begin, std::size_t end,
                std::size_t size, const float* vectors);

// The arrays of the following have room for padded(n), zeros behind n.

template <typename Real>
struct BoxedStep {
    const Real* value;  // between low and high
    const Real* step;   // taken away from value
    const Real* low;
    const Real* high;
};

// out := the share of the step after which a value meets its bound, at least 0, infinite where the whole step
// stays inside; returns the least of them.
[[nodiscard]] float room_ahead(const BoxedStep<float>& step, std::size_t n, float* out);
[[nodiscard]] double room_ahead(const BoxedStep<double>& step, std::size_t n, double* out);

// out := clamp(value - length step, low, high); low where the step is no number. `out` may be `value`.
void move_inside(const BoxedStep<float>& step, float length, std::size_t n, float* out);
void move_inside(const BoxedStep<double>& step, double length, std::size_t n, double* out);

template <typename Real>
struct JacobiStep {
    const Real* x;
    const Real* gradient;
    const Real* scale;  // 1 / H_ii
    const Real* low;
    const Real* high;
};

// out := |x - clamp(x - scale gradient, low, high)|, no number where the step is none; returns the largest of
// the others.
[[nodiscard]] float projected_moves(const JacobiStep<float>& step, std::size_t n, float* out);
[[nodiscard]] double projected_moves(const JacobiStep<double>& step, std::size_t n, double* out);

// max |a[i] b[i]|, or max |a[i]| when b is null; zeros behind n. What is no number does not count.
[[nodiscard]] float largest_product(const float* a, const float* b, std::size_t n);
[[nodiscard]] double largest_product(const double* a, const double* b, std::size_t n);

}  // namespace rig
