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
// n a multiple of kLaneFloats; `start` may be null (zero) or `out` itself; nothing else may overlap.
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

// The symmetric k x k matrix m := m + u u^T (or m - u u^T), rows `stride` apart, over columns
// [0, padded(k)); stays exactly symmetric.
void add_square(float* m, std::size_t stride, std::size_t k, const float* u);
void add_square(double* m, std::size_t stride, std::size_t k, const double* u);
void subtract_square(float* m, std::size_t stride, std::size_t k, const float* u);
void subtract_square(double* m, std::size_t stride, std::size_t k, const double* u);

}  // namespace rig
