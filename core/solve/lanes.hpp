// A short row of floats held in registers: what solvers of a few variables compute with instead of loops with
// branches, whose wrong guesses would cost more than the arithmetic. Elementwise, or reduced in one fixed
// tree, so the bits do not depend on the machine's vector width.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace rig {

// kWidth floats, a multiple of 4, at most 32. Loads and stores take addresses of 16-byte alignment.
template <std::size_t kWidth>
class Lanes {
  public:
    using Four = float __attribute__((vector_size(16), may_alias));
    using FourBits = std::int32_t __attribute__((vector_size(16)));

    Lanes() = default;
    explicit Lanes(float x) {
        for (Four& v : v_) v = Four{x, x, x, x};
    }
    explicit Lanes(const float* from) {
        for (std::size_t a = 0; a < kFours; ++a) v_[a] = reinterpret_cast<const Four*>(from)[a];
    }
    void store(float* to) const {
        for (std::size_t a = 0; a < kFours; ++a) reinterpret_cast<Four*>(to)[a] = v_[a];
    }

    Lanes& operator+=(const Lanes& y) {
        for (std::size_t a = 0; a < kFours; ++a) v_[a] += y.v_[a];
        return *this;
    }
    Lanes& operator*=(float y) {
        for (Four& v : v_) v *= y;
        return *this;
    }
    friend Lanes operator+(Lanes x, const Lanes& y) { return x += y; }
    friend Lanes operator-(Lanes x, const Lanes& y) {
        for (std::size_t a = 0; a < kFours; ++a) x.v_[a] -= y.v_[a];
        return x;
    }
    friend Lanes operator*(Lanes x, const Lanes& y) {
        for (std::size_t a = 0; a < kFours; ++a) x.v_[a] *= y.v_[a];
        return x;
    }
    friend Lanes operator*(float y, Lanes x) { return x *= y; }

    // NaN counts as not above.
    [[nodiscard]] Lanes above_zero() const {
        Lanes out;
        for (std::size_t a = 0; a < kFours; ++a) out.v_[a] = v_[a] > Four{} ? v_[a] : Four{};
        return out;
    }
    [[nodiscard]] Lanes magnitude() const {
        Lanes out;
        for (std::size_t a = 0; a < kFours; ++a) {
            FourBits bits;
            std::memcpy(&bits, &v_[a], sizeof(bits));
            bits &= FourBits{} + 0x7fffffff;
            std::memcpy(&out.v_[a], &bits, sizeof(bits));
        }
        return out;
    }

    // ((x0 + x2) + (x1 + x3)) of the fours' own sums, which are taken in halves.
    [[nodiscard]] float sum() const {
        Four v[kFours];
        for (std::size_t a = 0; a < kFours; ++a) v[a] = v_[a];
        for (std::size_t half = kFours / 2; half > 0; half /= 2) {
            for (std::size_t a = 0; a < half; ++a) v[a] += v[a + half];
        }
        return (v[0][0] + v[0][2]) + (v[0][1] + v[0][3]);
    }
    // Of numbers that are not NaN.
    [[nodiscard]] float largest() const {
        Four v[kFours];
        for (std::size_t a = 0; a < kFours; ++a) v[a] = v_[a];
        for (std::size_t half = kFours / 2; half > 0; half /= 2) {
            for (std::size_t a = 0; a < half; ++a) v[a] = v[a] > v[a + half] ? v[a] : v[a + half];
        }
        const float x = v[0][0] > v[0][2] ? v[0][0] : v[0][2];
        const float y = v[0][1] > v[0][3] ? v[0][1] : v[0][3];
        return x > y ? x : y;
    }
    // One bit a lane: set where it is above y. Never for NaN.
    [[nodiscard]] std::uint32_t above(float y) const {
        FourBits bits{};
        for (std::size_t a = 0; a < kFours; ++a) {
            const int first = static_cast<int>(1U << (4 * a));
            const FourBits lane{first, 2 * first, 4 * first, static_cast<int>(8U << (4 * a))};
            bits |= (v_[a] > Four{y, y, y, y}) & lane;
        }
        const FourBits folded = bits;
        return static_cast<std::uint32_t>((folded[0] | folded[2]) | (folded[1] | folded[3]));
    }

    // this += sum_r x[r] row_r, rows kWidth apart.
    void add_rows(const float* rows, const float* x, std::size_t count) {
        for (std::size_t r = 0; r < count; ++r) *this += x[r] * Lanes(rows + r * kWidth);
    }

  private:
    static constexpr std::size_t kFours = kWidth / 4;
    static_assert(kWidth % 4 == 0 && kWidth <= 32 && (kFours & (kFours - 1)) == 0);
    Four v_[kFours];
};

}  // namespace rig
