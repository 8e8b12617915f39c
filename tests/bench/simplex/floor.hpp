// The arithmetic that no exact solver of a region can avoid: one G^T g product, one application of the
// inverse at the size of the working set, one gradient.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace rig::bench {

struct FloorProblem {
    std::size_t rows = 0;
    std::size_t stride = 0;
    const float* examples = nullptr;      // [rows x stride]
    const float* gram = nullptr;          // [n x stride]
    const float* inverse = nullptr;       // [k x padded(k)]
    const float* target = nullptr;        // [rows]
    std::span<const std::uint16_t> used;  // k examples
    std::span<const float> coefficients;  // theirs
};

// A number that depends on all of it, so that none is left out.
[[nodiscard]] float run_floor(const FloorProblem& problem);

}  // namespace rig::bench
