#include "tests/bench/solve/dot_form_floor.hpp"

#include "core/base/float_kernels.hpp"
#include "core/base/float_vector.hpp"

namespace rig::test {

namespace {

void plain_product(const DotFormMatrix& m, const float* x, float* y) {
    const std::size_t stride = padded(m.columns);
    for (std::size_t r = 0; r < m.rows; ++r) {
        float sum = 0.0F;
        for (std::size_t c = 0; c < m.columns; ++c) sum += m.values[r * stride + c] * x[c];
        y[r] = sum;
    }
}

// 16 partial sums in registers, added in a tree.
float wide_dot(const float* a, const float* b, std::size_t n) {
    constexpr std::size_t kVectors = kLaneFloats / kFloatVectorWidth;
    FloatVector sum[kVectors]{};
    for (std::size_t i = 0; i < n; i += kLaneFloats) {
        for (std::size_t v = 0; v < kVectors; ++v) {
            const std::size_t at = i + v * kFloatVectorWidth;
            sum[v] += load_floats(a + at) * load_floats(b + at);
        }
    }
    for (std::size_t half = kVectors / 2; half > 0; half /= 2) {
        for (std::size_t v = 0; v < half; ++v) sum[v] += sum[v + half];
    }
    float total[kFloatVectorWidth];
    store_floats(total, sum[0]);
    for (std::size_t half = kFloatVectorWidth / 2; half > 0; half /= 2) {
        for (std::size_t i = 0; i < half; ++i) total[i] += total[i + half];
    }
    return total[0];
}

void wide_product(const DotFormMatrix& m, const float* x, float* y) {
    const std::size_t stride = padded(m.columns);
    for (std::size_t r = 0; r < m.rows; ++r) y[r] = wide_dot(m.values.data() + r * stride, x, stride);
}

}  // namespace

void dot_form_plain(const DotFormChain& chain, const float* t, float* x, float* u, float* w) {
    plain_product(chain.basis, t, x);
    plain_product(chain.centres, x, u);
    plain_product(chain.weights, u, w);
}

void dot_form_wide(const DotFormChain& chain, const float* t, float* x, float* u, float* w) {
    wide_product(chain.basis, t, x);
    wide_product(chain.centres, x, u);
    wide_product(chain.weights, u, w);
}

}  // namespace rig::test
