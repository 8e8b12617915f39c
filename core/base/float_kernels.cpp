#include "core/base/float_kernels.hpp"

#include <cstring>

namespace rig {

namespace {

// As wide as the target's registers: the width changes the speed and nothing else.
#if defined(__AVX512F__)
constexpr std::size_t kVectorBytes = 64;
#elif defined(__AVX__)
constexpr std::size_t kVectorBytes = 32;
#else
constexpr std::size_t kVectorBytes = 16;
#endif
constexpr std::size_t kMostSums = 12;  // kept in registers: hides the latency, leaves room for operands

// GCC takes the attribute's size from a template parameter only through a struct.
template <typename Real>
struct Wide {
    using Vector [[gnu::vector_size(kVectorBytes), gnu::aligned(alignof(Real)), gnu::may_alias]] = Real;
    static constexpr std::size_t kLanes = kVectorBytes / sizeof(Real);

    static const Vector& at(const Real* p) { return *reinterpret_cast<const Vector*>(p); }
    static Vector& at(Real* p) { return *reinterpret_cast<Vector*>(p); }
};

template <typename Real>
struct Rows {
    const Real* first;
    std::size_t stride;
    const std::uint16_t* index;  // null: all, in order
};

// `kSums` neighbouring vectors of the output, in registers from the first row to the last.
template <typename Real, bool kIndexed, std::size_t kSums>
void combine_strip(const Rows<Real>& rows, const Real* coefficient, std::size_t count, const Real* start,
                   Real* out) {
    using W = Wide<Real>;
    typename W::Vector sum[kSums];
    for (std::size_t s = 0; s < kSums; ++s) {
        sum[s] = start != nullptr ? W::at(start + s * W::kLanes) : typename W::Vector{};
    }
    for (std::size_t r = 0; r < count; ++r) {
        const Real* row = rows.first + (kIndexed ? std::size_t{rows.index[r]} : r) * rows.stride;
        const Real c = coefficient[r];
        for (std::size_t s = 0; s < kSums; ++s) sum[s] += c * W::at(row + s * W::kLanes);
    }
    for (std::size_t s = 0; s < kSums; ++s) W::at(out + s * W::kLanes) = sum[s];
}

template <typename Real, bool kIndexed, std::size_t kSums = kMostSums>
void strip_of(std::size_t sums, const Rows<Real>& rows, const Real* coefficient, std::size_t count,
              const Real* start, Real* out) {
    if constexpr (kSums > 0) {
        if (sums == kSums) {
            combine_strip<Real, kIndexed, kSums>(rows, coefficient, count, start, out);
        } else {
            strip_of<Real, kIndexed, kSums - 1>(sums, rows, coefficient, count, start, out);
        }
    }
}

// In strips of nearly equal width: a narrow last one would wait for its own sums.
template <typename Real, bool kIndexed>
void combine(const Rows<Real>& rows, const Real* coefficient, std::size_t count, std::size_t n,
             const Real* start, Real* out) {
    const std::size_t vectors = n / Wide<Real>::kLanes;
    const std::size_t strips = (vectors + kMostSums - 1) / kMostSums;
    std::size_t done = 0;
    for (std::size_t strip = 0; strip < strips; ++strip) {
        const std::size_t left = strips - strip;
        const std::size_t sums = (vectors - done + left - 1) / left;
        const std::size_t column = done * Wide<Real>::kLanes;
        strip_of<Real, kIndexed>(sums, {rows.first + column, rows.stride, rows.index}, coefficient, count,
                                 start != nullptr ? start + column : nullptr, out + column);
        done += sums;
    }
}

template <typename Real>
Real dot_of(const Real* a, const Real* b, std::size_t n) {
    using W = Wide<Real>;
    constexpr std::size_t kParts = kLaneFloats / W::kLanes;
    typename W::Vector sum[kParts]{};
    for (std::size_t i = 0; i < n; i += kLaneFloats) {
        for (std::size_t s = 0; s < kParts; ++s)
            sum[s] += W::at(a + i + s * W::kLanes) * W::at(b + i + s * W::kLanes);
    }
    Real s[kLaneFloats];
    std::memcpy(s, sum, sizeof(s));
    for (std::size_t half = kLaneFloats / 2; half > 0; half /= 2) {
        for (std::size_t i = 0; i < half; ++i) s[i] += s[i + half];
    }
    return s[0];
}

// u[r] u[c] = u[c] u[r] to the bit, so a symmetric matrix stays symmetric.
template <typename Real, bool kAdd>
void square(Real* m, std::size_t stride, std::size_t k, const Real* u) {
    using W = Wide<Real>;
    const std::size_t columns = padded(k);
    for (std::size_t r = 0; r < k; ++r) {
        Real* row = m + r * stride;
        const Real factor = kAdd ? u[r] : -u[r];
        for (std::size_t c = 0; c < columns; c += kLaneFloats) {
            for (std::size_t s = 0; s < kLaneFloats; s += W::kLanes)
                W::at(row + c + s) += factor * W::at(u + c + s);
        }
    }
}

}  // namespace

void combine_rows(const float* rows, std::size_t stride, const float* coefficient, std::size_t count,
                  std::size_t n, const float* start, float* out) {
    combine<float, false>({rows, stride, nullptr}, coefficient, count, n, start, out);
}
void combine_rows(const double* rows, std::size_t stride, const double* coefficient, std::size_t count,
                  std::size_t n, const double* start, double* out) {
    combine<double, false>({rows, stride, nullptr}, coefficient, count, n, start, out);
}

void combine_rows(const float* rows, std::size_t stride, const std::uint16_t* index, const float* coefficient,
                  std::size_t count, std::size_t n, const float* start, float* out) {
    combine<float, true>({rows, stride, index}, coefficient, count, n, start, out);
}
void combine_rows(const double* rows, std::size_t stride, const std::uint16_t* index,
                  const double* coefficient, std::size_t count, std::size_t n, const double* start,
                  double* out) {
    combine<double, true>({rows, stride, index}, coefficient, count, n, start, out);
}

float padded_dot(const float* a, const float* b, std::size_t n) {
    return dot_of(a, b, n);
}
double padded_dot(const double* a, const double* b, std::size_t n) {
    return dot_of(a, b, n);
}

void add_square(float* m, std::size_t stride, std::size_t k, const float* u) {
    square<float, true>(m, stride, k, u);
}
void add_square(double* m, std::size_t stride, std::size_t k, const double* u) {
    square<double, true>(m, stride, k, u);
}
void subtract_square(float* m, std::size_t stride, std::size_t k, const float* u) {
    square<float, false>(m, stride, k, u);
}
void subtract_square(double* m, std::size_t stride, std::size_t k, const double* u) {
    square<double, false>(m, stride, k, u);
}

}  // namespace rig
