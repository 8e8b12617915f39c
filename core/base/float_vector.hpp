// Vectors of float as wide as the target's registers, for loops in which every element stands alone: the
// width then changes the speed and no bit. Only +, -, *, / and comparisons; core's targets forbid
// contraction.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace rig {

#if defined(__AVX512F__)
inline constexpr std::size_t kFloatVectorBytes = 64;
#elif defined(__AVX__)
inline constexpr std::size_t kFloatVectorBytes = 32;
#else
inline constexpr std::size_t kFloatVectorBytes = 16;
#endif
inline constexpr std::size_t kFloatVectorWidth = kFloatVectorBytes / sizeof(float);

using FloatVector = float __attribute__((vector_size(kFloatVectorBytes)));
using IntVector = std::int32_t __attribute__((vector_size(kFloatVectorBytes)));

// Any alignment.
[[nodiscard]] inline FloatVector load_floats(const float* from) {
    FloatVector out;
    std::memcpy(&out, from, sizeof(out));
    return out;
}
inline void store_floats(float* to, FloatVector values) {
    std::memcpy(to, &values, sizeof(values));
}
[[nodiscard]] inline FloatVector all_floats(float value) {
    return FloatVector{} + value;
}
// The same bits read as the other type.
[[nodiscard]] inline IntVector bits_of(FloatVector values) {
    IntVector out;
    std::memcpy(&out, &values, sizeof(out));
    return out;
}
[[nodiscard]] inline FloatVector floats_of(IntVector bits) {
    FloatVector out;
    std::memcpy(&out, &bits, sizeof(out));
    return out;
}

// a + b modulo 2^32.
[[nodiscard]] inline IntVector plus_wrapping(IntVector a, IntVector b) {
    using UnsignedVector = std::uint32_t __attribute__((vector_size(kFloatVectorBytes)));
    UnsignedVector ua;
    UnsignedVector ub;
    std::memcpy(&ua, &a, sizeof(ua));
    std::memcpy(&ub, &b, sizeof(ub));
    ua += ub;
    std::memcpy(&a, &ua, sizeof(a));
    return a;
}

}  // namespace rig
