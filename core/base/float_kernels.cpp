#include "core/base/float_kernels.hpp"

#include <cstring>

namespace rig {

namespace {

// As wide as the target's registers; the width changes the speed and nothing else.
#if defined(__AVX512F__)
constexpr std::size_t kVectorBytes = 64;
#elif defined(__AVX__)
constexpr std::size_t kVectorBytes = 32;
#else
constexpr std::size_t kVectorBytes = 16;
#endif
constexpr std::size_t kWide = kVectorBytes / sizeof(float);
constexpr std::size_t kMostSums = 12;  // sums kept in registers: hides the latency, leaves room for operands

using Vector = float __attribute__((vector_size(kVectorBytes), aligned(4), may_alias));
using Sums = float __attribute__((vector_size(64)));

inline const Vector& vector_at(const float* p) {
    return *reinterpret_cast<const Vector*>(p);
}
inline Vector& vector_at(float* p) {
    return *reinterpret_cast<Vector*>(p);
}

struct Rows {
    const float* first;
    std::size_t stride;
    const std::uint16_t* index;  // null: all, in order

    [[nodiscard]] const float* row(std::size_t r) const {
        return first + (index != nullptr ? std::size_t{index[r]} : r) * stride;
    }
};

// `kSums` neighbouring vectors of the output, in registers from the first row to the last.
template <std::size_t kSums, bool kIndexed>
void combine_strip(const Rows& rows, const float* coefficient, std::size_t count, const float* start,
                   float* out) {
    Vector sum[kSums];
    for (std::size_t s = 0; s < kSums; ++s) {
        sum[s] = start != nullptr ? vector_at(start + s * kWide) : Vector{};
    }
    for (std::size_t r = 0; r < count; ++r) {
        const float* row = rows.first + (kIndexed ? std::size_t{rows.index[r]} : r) * rows.stride;
        const float c = coefficient[r];
        for (std::size_t s = 0; s < kSums; ++s) sum[s] += c * vector_at(row + s * kWide);
    }
    for (std::size_t s = 0; s < kSums; ++s) vector_at(out + s * kWide) = sum[s];
}

template <bool kIndexed, std::size_t kSums = kMostSums>
void strip_of(std::size_t sums, const Rows& rows, const float* coefficient, std::size_t count,
              const float* start, float* out) {
    if constexpr (kSums > 0) {
        if (sums == kSums) return combine_strip<kSums, kIndexed>(rows, coefficient, count, start, out);
        strip_of<kIndexed, kSums - 1>(sums, rows, coefficient, count, start, out);
    }
}

template <bool kIndexed>
void combine(Rows rows, const float* coefficient, std::size_t count, std::size_t n, const float* start,
             float* out) {
    const std::size_t vectors = n / kWide;
    const std::size_t strips = (vectors + kMostSums - 1) / kMostSums;
    std::size_t done = 0;
    for (std::size_t strip = 0; strip < strips; ++strip) {
        const std::size_t sums = (vectors - done + strips - strip - 1) / (strips - strip);
        const std::size_t column = done * kWide;
        strip_of<kIndexed>(sums, {rows.first + column, rows.stride, rows.index}, coefficient, count,
                           start != nullptr ? start + column : nullptr, out + column);
        done += sums;
    }
}

}  // namespace

void combine_rows(const float* rows, std::size_t stride, const float* coefficient, std::size_t count,
                  std::size_t n, const float* start, float* out) {
    combine<false>({rows, stride, nullptr}, coefficient, count, n, start, out);
}

void combine_rows(const float* rows, std::size_t stride, const std::uint16_t* index, const float* coefficient,
                  std::size_t count, std::size_t n, const float* start, float* out) {
    combine<true>({rows, stride, index}, coefficient, count, n, start, out);
}

float dot(const float* a, const float* b, std::size_t n) {
    Sums sum{};
    for (std::size_t i = 0; i < n; i += kLaneFloats) {
        Sums x, y;
        std::memcpy(&x, a + i, sizeof(x));
        std::memcpy(&y, b + i, sizeof(y));
        sum += x * y;
    }
    float s[kLaneFloats];
    std::memcpy(s, &sum, sizeof(sum));
    for (std::size_t half = kLaneFloats / 2; half > 0; half /= 2) {
        for (std::size_t i = 0; i < half; ++i) s[i] += s[i + half];
    }
    return s[0];
}

void add_outer(float* m, std::size_t stride, std::size_t k, float factor, const float* u) {
    const std::size_t columns = padded(k);
    for (std::size_t r = 0; r < k; ++r) {
        float* row = m + r * stride;
        const float ur = u[r];
        for (std::size_t c = 0; c < columns; c += kWide) {
            // u[r] u[c] first: the product commutes, so m stays exactly symmetric
            vector_at(row + c) += factor * (ur * vector_at(u + c));
        }
    }
}

}  // namespace rig
