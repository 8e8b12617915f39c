#include "tests/bench/simplex/floor.hpp"

#include <array>

#include "core/base/float_kernels.hpp"
#include "core/limits.hpp"

namespace rig::bench {

float run_floor(const FloorProblem& p) {
    alignas(64) std::array<float, kMaxRegionShapes> linear;
    alignas(64) std::array<float, kMaxRegionShapes> right{};
    alignas(64) std::array<float, kMaxRegionShapes> aim;
    alignas(64) std::array<float, kMaxRegionShapes> gradient;
    const std::size_t k = p.used.size();
    combine_rows(p.examples, p.stride, p.target, p.rows, p.stride, nullptr, linear.data());
    for (std::size_t a = 0; a < k; ++a) right[a] = linear[p.used[a]];
    combine_rows(p.inverse, padded(k), right.data(), k, padded(k), nullptr, aim.data());
    combine_rows(p.gram, p.stride, p.used.data(), p.coefficients.data(), k, p.stride, linear.data(),
                 gradient.data());
    return aim[0] + gradient[0];
}

}  // namespace rig::bench
