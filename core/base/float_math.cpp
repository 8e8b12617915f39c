#include "core/base/float_math.hpp"

#include <array>
#include <limits>

#include "core/base/check.hpp"
#include "core/base/float_kernels.hpp"
#include "core/base/float_vector.hpp"

namespace rig {

namespace {

constexpr float kInvLn2 = 1.44269504F;
constexpr float kLn2High = 0.693359375F;  // ln 2 split so that k * high is exact
constexpr float kLn2Low = -2.12194440e-4F;
constexpr float kShift = 12582912.0F;  // 1.5 * 2^23: adding it rounds to an integer
constexpr float kLeastExponent = -87.0F;
constexpr float kMostExponent = 88.0F;

constexpr std::array<float, 6> kExp{1.9875691500e-4F, 1.3981999507e-3F, 8.3334519073e-3F,
                                    4.1665795894e-2F, 1.6666665459e-1F, 5.0000001201e-1F};
constexpr std::array<float, 9> kLog{7.0376836292e-2F,  -1.1514610310e-1F, 1.1676998740e-1F,
                                    -1.2420140846e-1F, 1.4249322787e-1F,  -1.6668057665e-1F,
                                    2.0000714765e-1F,  -2.4999993993e-1F, 3.3333331174e-1F};

template <std::size_t kTerms>
FloatVector polynomial(const std::array<float, kTerms>& coefficient, FloatVector x) {
    FloatVector sum = all_floats(coefficient[0]);
    for (std::size_t i = 1; i < kTerms; ++i) sum = sum * x + coefficient[i];
    return sum;
}

FloatVector exp_of(FloatVector x) {
    const FloatVector shifted = x * kInvLn2 + kShift;
    const FloatVector k = shifted - kShift;
    const FloatVector r = (x - k * kLn2High) - k * kLn2Low;  // |r| <= ln2 / 2
    const FloatVector value = polynomial(kExp, r) * (r * r) + r + 1.0F;
    // The integer k stands in the low bits of `shifted`; moved into the exponent it multiplies by 2^k.
    // Unsigned, because what is out of range wraps here and is replaced below.
    const FloatVector scaled = floats_of(plus_wrapping(bits_of(value), bits_of(shifted) << 23));
    const FloatVector bounded =
        x > kMostExponent ? all_floats(std::numeric_limits<float>::infinity()) : scaled;
    const FloatVector floored = x < kLeastExponent ? all_floats(0.0F) : bounded;
    return x == x ? floored : x;
}

FloatVector log_of(FloatVector x) {
    const FloatVector least = all_floats(std::numeric_limits<float>::min());
    const FloatVector positive = x < least ? least : x;
    constexpr std::int32_t kRootHalfBits = 0x3f3504f3;  // sqrt(1/2)
    const IntVector bits = bits_of(positive);
    const IntVector exponent = (bits - kRootHalfBits) >> 23;
    const FloatVector e = __builtin_convertvector(exponent, FloatVector);
    const FloatVector m = floats_of(bits - (exponent << 23)) - 1.0F;  // sqrt(1/2) - 1 <= m < sqrt(2) - 1
    const FloatVector m2 = m * m;
    const FloatVector tail = polynomial(kLog, m) * m * m2 + e * kLn2Low - 0.5F * m2;
    const FloatVector value = (m + tail) + e * kLn2High;
    return x == x ? value : x;
}

}  // namespace

void exp_each(const float* x, std::size_t n, float* out) {
    RIG_CHECK(n % kLaneFloats == 0);
    for (std::size_t i = 0; i < n; i += kFloatVectorWidth) store_floats(out + i, exp_of(load_floats(x + i)));
}

void log_each(const float* x, std::size_t n, float* out) {
    RIG_CHECK(n % kLaneFloats == 0);
    for (std::size_t i = 0; i < n; i += kFloatVectorWidth) store_floats(out + i, log_of(load_floats(x + i)));
}

}  // namespace rig
