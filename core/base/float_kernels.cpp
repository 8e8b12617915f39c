#include "core/base/float_kernels.hpp"

#include <cstring>
#include <limits>

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
constexpr std::size_t kTogether = 4;   // rows of a square
constexpr std::size_t kMostSums = 12;  // kept in registers: hides the latency, leaves room for operands

// GCC takes the attribute's size from a template parameter only through a struct.
template <typename Real>
struct Wide {
    using Vector [[gnu::vector_size(kVectorBytes), gnu::aligned(alignof(Real)), gnu::may_alias]] = Real;
    static constexpr std::size_t kLanes = kVectorBytes / sizeof(Real);

    static const Vector& at(const Real* p) { return *reinterpret_cast<const Vector*>(p); }
    static Vector& at(Real* p) { return *reinterpret_cast<Vector*>(p); }

    // Vectors that hold n elements: what the machine can skip of the padding it skips.
    static constexpr std::size_t vectors(std::size_t n) { return (n + kLanes - 1) / kLanes; }
};

template <typename Vector>
Vector larger(const Vector& a, const Vector& b) {  // a where either is no number
    return a < b ? b : a;
}

template <typename Vector>
Vector smaller(const Vector& a, const Vector& b) {
    return b < a ? b : a;
}

// The order does not matter, so neither does the width.
template <typename Real>
Real largest_of(const typename Wide<Real>::Vector& v) {
    Real largest = v[0];
    for (std::size_t i = 1; i < Wide<Real>::kLanes; ++i) largest = largest < v[i] ? v[i] : largest;
    return largest;
}

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
    const std::size_t vectors = Wide<Real>::vectors(n);
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
    for (std::size_t half = kParts / 2; half > 0; half /= 2) {
        for (std::size_t i = 0; i < half; ++i) sum[i] += sum[i + half];
    }
    Real s[W::kLanes];
    std::memcpy(s, sum, sizeof(s));
    for (std::size_t half = W::kLanes / 2; half > 0; half /= 2) {
        for (std::size_t i = 0; i < half; ++i) s[i] += s[i + half];
    }
    return s[0];
}

// `kRows` neighbouring rows of the square, so that u is read once for all of them.
template <typename Real, bool kAdd, std::size_t kRows>
void square_rows(Real* m, std::size_t stride, std::size_t r, std::size_t vectors, const Real* u) {
    using W = Wide<Real>;
    Real factor[kRows];
    for (std::size_t i = 0; i < kRows; ++i) factor[i] = kAdd ? u[r + i] : -u[r + i];
    Real* row = m + r * stride;
    for (std::size_t c = 0; c < vectors * W::kLanes; c += W::kLanes) {
        const typename W::Vector v = W::at(u + c);
        for (std::size_t i = 0; i < kRows; ++i) W::at(row + i * stride + c) += factor[i] * v;
    }
}

// u[r] u[c] = u[c] u[r] to the bit, so a symmetric matrix stays symmetric.
template <typename Real, bool kAdd>
void square(Real* m, std::size_t stride, std::size_t k, const Real* u) {
    const std::size_t vectors = Wide<Real>::vectors(k);
    std::size_t r = 0;
    for (; r + kTogether <= k; r += kTogether) square_rows<Real, kAdd, kTogether>(m, stride, r, vectors, u);
    for (; r < k; ++r) square_rows<Real, kAdd, 1>(m, stride, r, vectors, u);
}

// to := the transpose of a block of four rows and columns, 16 bytes at a time in registers.
void turn_block(const float* from, float* to, std::size_t stride) {
    using Four [[gnu::vector_size(16), gnu::aligned(4), gnu::may_alias]] = float;
    const auto at = [&](std::size_t i) { return *reinterpret_cast<const Four*>(from + i * stride); };
    const Four a = at(0), b = at(1), c = at(2), d = at(3);
    const Four ab_low = __builtin_shufflevector(a, b, 0, 4, 1, 5);
    const Four ab_high = __builtin_shufflevector(a, b, 2, 6, 3, 7);
    const Four cd_low = __builtin_shufflevector(c, d, 0, 4, 1, 5);
    const Four cd_high = __builtin_shufflevector(c, d, 2, 6, 3, 7);
    const auto put = [&](std::size_t i, const Four& v) { *reinterpret_cast<Four*>(to + i * stride) = v; };
    put(0, __builtin_shufflevector(ab_low, cd_low, 0, 1, 4, 5));
    put(1, __builtin_shufflevector(ab_low, cd_low, 2, 3, 6, 7));
    put(2, __builtin_shufflevector(ab_high, cd_high, 0, 1, 4, 5));
    put(3, __builtin_shufflevector(ab_high, cd_high, 2, 3, 6, 7));
}
void turn_block(const double* from, double* to, std::size_t stride) {
    using Two [[gnu::vector_size(16), gnu::aligned(8), gnu::may_alias]] = double;
    for (std::size_t r = 0; r < kTogether; r += 2) {
        for (std::size_t c = 0; c < kTogether; c += 2) {
            const Two a = *reinterpret_cast<const Two*>(from + r * stride + c);
            const Two b = *reinterpret_cast<const Two*>(from + (r + 1) * stride + c);
            *reinterpret_cast<Two*>(to + c * stride + r) = __builtin_shufflevector(a, b, 0, 2);
            *reinterpret_cast<Two*>(to + (c + 1) * stride + r) = __builtin_shufflevector(a, b, 1, 3);
        }
    }
}

// Vectors u_j [k], rows of a matrix, and what each counts.
template <typename Real>
struct Terms {
    const Real* first;
    std::size_t stride;
    const Real* sign;
    std::size_t count;
};

// `kSums` neighbouring vectors of kTogether rows, from column c of row r on.
template <typename Real, std::size_t kSums>
void squares_strip(Real* m, const Terms<Real>& terms, std::size_t r, std::size_t c) {
    using W = Wide<Real>;
    for (std::size_t i = r; i < r + kTogether; ++i) {
        Real* out = m + i * terms.stride + c;
        typename W::Vector sum[kSums];
        for (std::size_t s = 0; s < kSums; ++s) sum[s] = W::at(out + s * W::kLanes);
        const Real* u = terms.first;
        for (std::size_t j = 0; j < terms.count; ++j, u += terms.stride) {
            const Real factor = terms.sign[j] * u[i];
            for (std::size_t s = 0; s < kSums; ++s) sum[s] += factor * W::at(u + c + s * W::kLanes);
        }
        for (std::size_t s = 0; s < kSums; ++s) W::at(out + s * W::kLanes) = sum[s];
    }
}

template <typename Real, std::size_t kSums = kMostSums>
void squares_of(std::size_t sums, Real* m, const Terms<Real>& terms, std::size_t r, std::size_t c) {
    if constexpr (kSums > 0) {
        if (sums == kSums) {
            squares_strip<Real, kSums>(m, terms, r, c);
        } else {
            squares_of<Real, kSums - 1>(sums, m, terms, r, c);
        }
    }
}

// From the diagonal to the right, kTogether rows at a time, then the mirror image. A wide vector begins left
// of the diagonal; what it spoils there the mirror image replaces.
template <typename Real>
void squares(Real* m, std::size_t k, const Terms<Real>& terms) {
    constexpr std::size_t kLanes = Wide<Real>::kLanes;
    const std::size_t vectors = Wide<Real>::vectors(k);
    for (std::size_t r = 0; r < k; r += kTogether) {
        for (std::size_t done = r / kLanes; done < vectors;) {
            const std::size_t sums = vectors - done < kMostSums ? vectors - done : kMostSums;
            squares_of(sums, m, terms, r, done * kLanes);
            done += sums;
        }
    }
    for (std::size_t r = 0; r < k; r += kTogether) {
        for (std::size_t c = r + kTogether; c < k; c += kTogether) {
            turn_block(m + r * terms.stride + c, m + c * terms.stride + r, terms.stride);
        }
    }
}

template <typename Real>
Real room(const BoxedStep<Real>& s, std::size_t n, Real* out) {
    using W = Wide<Real>;
    using Vector = typename W::Vector;
    const Vector none{};
    const Vector endless = none + std::numeric_limits<Real>::infinity();
    Vector least = endless;
    for (std::size_t c = 0; c < W::vectors(n) * W::kLanes; c += W::kLanes) {
        const Vector value = W::at(s.value + c);
        const Vector step = W::at(s.step + c);
        const Vector low = W::at(s.low + c);
        const Vector high = W::at(s.high + c);
        const Vector aim = value - step;
        const Vector share = larger(none, (value - (step > none ? low : high)) / step);
        const Vector length = (aim >= low) & (aim <= high) ? endless : share;
        W::at(out + c) = length;
        least = smaller(least, length);
    }
    Real all = least[0];
    for (std::size_t i = 1; i < W::kLanes; ++i) all = least[i] < all ? least[i] : all;
    return all;
}

template <typename Real>
void move(const BoxedStep<Real>& s, Real length, std::size_t n, Real* out) {
    using W = Wide<Real>;
    for (std::size_t c = 0; c < W::vectors(n) * W::kLanes; c += W::kLanes) {
        const typename W::Vector aim = W::at(s.value + c) - length * W::at(s.step + c);
        W::at(out + c) = smaller(larger(W::at(s.low + c), aim), W::at(s.high + c));
    }
}

template <typename Real>
Real moves(const JacobiStep<Real>& s, std::size_t n, Real* out) {
    using W = Wide<Real>;
    typename W::Vector largest{};
    for (std::size_t c = 0; c < W::vectors(n) * W::kLanes; c += W::kLanes) {
        const typename W::Vector x = W::at(s.x + c);
        const typename W::Vector aim = x - W::at(s.gradient + c) * W::at(s.scale + c);
        const typename W::Vector by = x - smaller(larger(aim, W::at(s.low + c)), W::at(s.high + c));
        const typename W::Vector size = larger(by, -by);
        W::at(out + c) = size;
        largest = larger(largest, size);
    }
    return largest_of<Real>(largest);
}

template <typename Real>
Real largest_magnitude(const Real* a, const Real* b, std::size_t n) {
    using W = Wide<Real>;
    typename W::Vector largest{};
    for (std::size_t c = 0; c < W::vectors(n) * W::kLanes; c += W::kLanes) {
        typename W::Vector v = W::at(a + c);
        if (b != nullptr) v *= W::at(b + c);
        largest = larger(largest, larger(v, -v));
    }
    return largest_of<Real>(largest);
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

void add_squares(float* m, std::size_t stride, std::size_t k, const float* vectors, const float* sign,
                 std::size_t count) {
    squares<float>(m, k, {vectors, stride, sign, count});
}
void add_squares(double* m, std::size_t stride, std::size_t k, const double* vectors, const double* sign,
                 std::size_t count) {
    squares<double>(m, k, {vectors, stride, sign, count});
}

void add_triple(float* m, std::size_t stride, const Triples& triples, std::size_t begin, std::size_t end,
                std::size_t size, const float* vectors) {
    using W = Wide<float>;
    for (std::size_t i = begin; i < end; ++i) {
        const float* t = triples.first + (i - begin) * triples.stride;
        const float t0 = t[0];
        const float t1 = t[1];
        const float t2 = t[2];
        float* row = m + i * stride;
        for (std::size_t c = i / W::kLanes * W::kLanes; c < size; c += W::kLanes) {
            W::at(row + c) = ((W::at(row + c) + t0 * W::at(vectors + c)) + t1 * W::at(vectors + stride + c)) +
                             t2 * W::at(vectors + 2 * stride + c);
        }
    }
}

float room_ahead(const BoxedStep<float>& step, std::size_t n, float* out) {
    return room(step, n, out);
}
double room_ahead(const BoxedStep<double>& step, std::size_t n, double* out) {
    return room(step, n, out);
}

void move_inside(const BoxedStep<float>& step, float length, std::size_t n, float* out) {
    move(step, length, n, out);
}
void move_inside(const BoxedStep<double>& step, double length, std::size_t n, double* out) {
    move(step, length, n, out);
}

float projected_moves(const JacobiStep<float>& step, std::size_t n, float* out) {
    return moves(step, n, out);
}
double projected_moves(const JacobiStep<double>& step, std::size_t n, double* out) {
    return moves(step, n, out);
}

float largest_product(const float* a, const float* b, std::size_t n) {
    return largest_magnitude(a, b, n);
}
double largest_product(const double* a, const double* b, std::size_t n) {
    return largest_magnitude(a, b, n);
}

}  // namespace rig
