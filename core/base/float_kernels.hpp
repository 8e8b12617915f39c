// Dense float kernels of the solvers. Every output element is summed in the order of the terms, so the bits
// depend neither on the width of the machine's vectors nor on the compiler; reductions keep 16 partial sums
// and add them in a fixed tree. No contraction: core's targets are built with -ffp-contract=off.
#pragma once

#include <cstddef>
#include <cstdint>

namespace rig {

inline constexpr std::size_t kLaneFloats = 16;  // rows are padded with zeros to a multiple of this

[[nodiscard]] constexpr std::size_t padded(std::size_t n) {
    return (n + kLaneFloats - 1) / kLaneFloats * kLaneFloats;
}

// out[c] = start[c] + sum_r coefficient[r] row_r[c], c in [0, n); row_r begins at rows + r stride.
// n a multiple of kLaneFloats; `start` may be null (zero) or `out` itself; nothing else may overlap.
void combine_rows(const float* rows, std::size_t stride, const float* coefficient, std::size_t count,
                  std::size_t n, const float* start, float* out);

// The same over the rows index[0, count) only.
void combine_rows(const float* rows, std::size_t stride, const std::uint16_t* index, const float* coefficient,
                  std::size_t count, std::size_t n, const float* start, float* out);

// Sum of a[i] b[i] over [0, n), n a multiple of kLaneFloats.
[[nodiscard]] float dot(const float* a, const float* b, std::size_t n);

// The symmetric k x k matrix m += factor u u^T, rows `stride` apart, columns [0, padded(k)); exactly
// symmetric.
void add_outer(float* m, std::size_t stride, std::size_t k, float factor, const float* u);

}  // namespace rig
