#include "core/base/float_kernels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/random.hpp"

namespace rig {
namespace {

using Precisions = testing::Types<float, double>;

template <typename Real>
class FloatKernels : public testing::Test {
  public:
    static std::vector<Real> numbers(std::size_t count, test::SeededRandom& random) {
        std::vector<Real> out(count);
        for (Real& x : out) x = static_cast<Real>(random.normal(0.0, 1.0));
        return out;
    }
};
TYPED_TEST_SUITE(FloatKernels, Precisions);

TEST(FloatKernelSizes, RowsArePaddedToLanesAndTheirDistanceIsAnOddNumberOfThem) {
    EXPECT_EQ(padded(0), 0U);
    EXPECT_EQ(padded(1), 16U);
    EXPECT_EQ(padded(16), 16U);
    EXPECT_EQ(padded(17), 32U);
    for (std::size_t n = 1; n < 400; ++n) {
        EXPECT_GE(row_stride(n), n);
        EXPECT_EQ(row_stride(n) / kLaneFloats % 2, 1U);
    }
}

// To the bit: every output element is the plain sum in the order of the rows, whatever the vectors' width.
TYPED_TEST(FloatKernels, CombineRowsIsThePlainSumToTheBit) {
    using Real = TypeParam;
    test::SeededRandom random(11);
    for (int trial = 0; trial < 200; ++trial) {
        const std::size_t n = padded(1 + random.below(300));
        const std::size_t count = random.below(40);
        const std::size_t stride = row_stride(n);
        const std::vector<Real> rows = this->numbers(64 * stride, random);
        const std::vector<Real> coefficient = this->numbers(64, random);
        const std::vector<Real> start = this->numbers(n, random);
        std::vector<std::uint16_t> index(count);
        for (std::uint16_t& i : index) i = static_cast<std::uint16_t>(random.below(64));
        std::vector<Real> all(n), chosen(n), from_zero(n);
        combine_rows(rows.data(), stride, coefficient.data(), count, n, start.data(), all.data());
        combine_rows(rows.data(), stride, index.data(), coefficient.data(), count, n, start.data(),
                     chosen.data());
        combine_rows(rows.data(), stride, coefficient.data(), count, n, nullptr, from_zero.data());
        for (std::size_t c = 0; c < n; ++c) {
            Real a = start[c], b = start[c], z(0);
            for (std::size_t r = 0; r < count; ++r) {
                a += coefficient[r] * rows[r * stride + c];
                b += coefficient[r] * rows[index[r] * stride + c];
                z += coefficient[r] * rows[r * stride + c];
            }
            ASSERT_EQ(all[c], a);
            ASSERT_EQ(chosen[c], b);
            ASSERT_EQ(from_zero[c], z);
        }
    }
}

TYPED_TEST(FloatKernels, CombineRowsMayWriteOverItsStart) {
    using Real = TypeParam;
    test::SeededRandom random(12);
    const std::vector<Real> rows = this->numbers(5 * 48, random);
    const std::vector<Real> coefficient = this->numbers(5, random);
    std::vector<Real> inout = this->numbers(48, random);
    std::vector<Real> out(48);
    combine_rows(rows.data(), 48, coefficient.data(), 5, 48, inout.data(), out.data());
    combine_rows(rows.data(), 48, coefficient.data(), 5, 48, inout.data(), inout.data());
    EXPECT_EQ(inout, out);
}

// 16 partial sums, added as a tree: 8 + 8, 4 + 4, 2 + 2, 1 + 1.
TYPED_TEST(FloatKernels, PaddedDotAddsItsPartsInTheFixedTree) {
    using Real = TypeParam;
    test::SeededRandom random(13);
    for (const std::size_t n : {0U, 16U, 32U, 304U}) {
        const std::vector<Real> a = this->numbers(n, random), b = this->numbers(n, random);
        Real part[16] = {};
        for (std::size_t i = 0; i < n; ++i) part[i % 16] += a[i] * b[i];
        for (std::size_t half = 8; half > 0; half /= 2) {
            for (std::size_t i = 0; i < half; ++i) part[i] += part[i + half];
        }
        EXPECT_EQ(padded_dot(a.data(), b.data(), n), part[0]);
    }
}

TYPED_TEST(FloatKernels, SquaresKeepAMatrixSymmetricToTheBit) {
    using Real = TypeParam;
    test::SeededRandom random(14);
    for (const std::size_t k : {1U, 15U, 16U, 33U}) {
        const std::size_t stride = row_stride(k);
        std::vector<Real> m(k * stride, Real(0));
        std::vector<Real> expected = m;
        for (int term = 0; term < 20; ++term) {
            std::vector<Real> u = this->numbers(padded(k), random);
            for (std::size_t i = k; i < u.size(); ++i) u[i] = Real(0);
            const bool add = term % 3 != 2;
            if (add) add_square(m.data(), stride, k, u.data());
            if (!add) subtract_square(m.data(), stride, k, u.data());
            for (std::size_t r = 0; r < k; ++r) {
                for (std::size_t c = 0; c < k; ++c) {
                    expected[r * stride + c] += (add ? u[r] : -u[r]) * u[c];
                    ASSERT_EQ(m[r * stride + c], expected[r * stride + c]);
                    ASSERT_EQ(m[r * stride + c], m[c * stride + r]);
                }
            }
        }
        for (std::size_t r = 0; r < k; ++r) {
            for (std::size_t c = k; c < padded(k); ++c)
                ASSERT_EQ(m[r * stride + c], Real(0)) << "the padding";
        }
    }
}

// One pass gives what the terms one after the other give, to the bit.
TYPED_TEST(FloatKernels, SquaresTogetherEqualSquaresInTurn) {
    using Real = TypeParam;
    test::SeededRandom random(16);
    for (std::size_t k = 1; k < 120; k += k < 40 ? 1 : 13) {
        const std::size_t stride = row_stride(k);
        std::vector<Real> m(padded(k) * stride, Real(0));
        std::vector<Real> expected = m;
        for (const std::size_t count : {1U, 2U, 8U, 13U}) {
            std::vector<Real> vectors = this->numbers(count * stride, random);
            std::vector<Real> sign(count);
            for (std::size_t j = 0; j < count; ++j) {
                sign[j] = random.chance(0.5) ? Real(1) : Real(-1);
                for (std::size_t i = k; i < stride; ++i) vectors[j * stride + i] = Real(0);
                const Real* u = vectors.data() + j * stride;
                if (sign[j] > Real(0)) add_square(expected.data(), stride, k, u);
                if (sign[j] < Real(0)) subtract_square(expected.data(), stride, k, u);
            }
            add_squares(m.data(), stride, k, vectors.data(), sign.data(), count);
            for (std::size_t i = 0; i < m.size(); ++i)
                ASSERT_EQ(m[i], expected[i]) << "k " << k << " row " << i / stride;
        }
    }
}

// The upper triangle, term by term in order; the columns beyond it stay what they were.
TEST(TripleRows, AddInOrder) {
    test::SeededRandom random(17);
    for (std::size_t size = 1; size < 60; size += 7) {
        const std::size_t stride = row_stride(size);
        std::vector<float> m(size * stride, 0.0F), vectors(3 * stride, 0.0F), triples(5 * size);
        for (std::size_t r = 0; r < 3; ++r) {
            for (std::size_t c = 0; c < size; ++c)
                vectors[r * stride + c] = static_cast<float>(random.normal(0.0, 1.0));
        }
        for (std::size_t r = 0; r < size; ++r) {
            for (std::size_t c = 0; c < size; ++c)
                m[r * stride + c] = static_cast<float>(random.normal(0.0, 1.0));
        }
        for (float& t : triples) t = static_cast<float>(random.normal(0.0, 1.0));
        std::vector<float> expected = m;
        const std::size_t begin = size / 3;
        for (std::size_t i = begin; i < size; ++i) {
            const float* t = triples.data() + 5 * (i - begin);
            for (std::size_t c = i; c < size; ++c) {
                float& sum = expected[i * stride + c];
                for (std::size_t r = 0; r < 3; ++r) sum += t[r] * vectors[r * stride + c];
            }
        }
        add_triple(m.data(), stride, {triples.data(), 5}, begin, size, size, vectors.data());
        for (std::size_t i = 0; i < size; ++i) {
            for (std::size_t c = i; c < stride; ++c) ASSERT_EQ(m[i * stride + c], expected[i * stride + c]);
        }
    }
}

// What lies behind n is skipped as far as the vectors allow, and nothing before it changes.
TYPED_TEST(FloatKernels, NarrowRowsGiveTheSameNumbers) {
    using Real = TypeParam;
    test::SeededRandom random(15);
    for (std::size_t n = 1; n < 70; ++n) {
        const std::size_t stride = row_stride(n);
        std::vector<Real> rows(n * stride, Real(0)), u(padded(n), Real(0)), out(padded(n), Real(0));
        for (std::size_t r = 0; r < n; ++r) {
            u[r] = static_cast<Real>(random.normal(0.0, 1.0));
            for (std::size_t c = 0; c < n; ++c)
                rows[r * stride + c] = static_cast<Real>(random.normal(0.0, 1.0));
        }
        std::vector<Real> whole(padded(n));
        combine_rows(rows.data(), stride, u.data(), n, padded(n), nullptr, whole.data());
        combine_rows(rows.data(), stride, u.data(), n, n, nullptr, out.data());
        EXPECT_EQ(out, whole);
    }
}

TYPED_TEST(FloatKernels, StepsEndAtTheFirstBound) {
    using Real = TypeParam;
    const Real infinity = std::numeric_limits<Real>::infinity();
    std::vector<Real> value(16), step(16), low(16), high(16), room(16), out(16);
    const auto set = [&](std::size_t i, double v, double s, Real l, Real h) {
        value[i] = static_cast<Real>(v);
        step[i] = static_cast<Real>(s);
        low[i] = l;
        high[i] = h;
    };
    set(0, 0.5, 0.25, Real(0), Real(1));   // stays inside
    set(1, 0.5, 1.0, Real(0), Real(1));    // falls: half way
    set(2, 0.25, -3.0, Real(0), Real(1));  // rises: a quarter
    EXPECT_EQ(room_ahead({value.data(), step.data(), low.data(), high.data()}, 3, room.data()), Real(0.25));
    EXPECT_EQ(room[0], infinity);
    EXPECT_EQ(room[1], Real(0.5));
    set(3, 0.0, 2.0, Real(0), Real(1));       // at its bound already
    set(4, 5.0, 100.0, -infinity, infinity);  // nothing in its way
    EXPECT_EQ(room_ahead({value.data(), step.data(), low.data(), high.data()}, 5, room.data()), Real(0));
    EXPECT_EQ(room[4], infinity);
    move_inside({value.data(), step.data(), low.data(), high.data()}, Real(0.5), 5, out.data());
    EXPECT_EQ(std::vector<Real>(out.begin(), out.begin() + 5),
              (std::vector<Real>{Real(0.375), Real(0), Real(1), Real(0), Real(-45)}));
}

TYPED_TEST(FloatKernels, ProjectedMovesStopAtTheBounds) {
    using Real = TypeParam;
    const Real nan = std::numeric_limits<Real>::quiet_NaN();
    std::vector<Real> x(16), g(16), scale(16), low(16), high(16), out(16);
    std::fill(high.begin(), high.end(), Real(1));
    std::fill(scale.begin(), scale.end(), Real(0.5));
    x[0] = Real(0.5), g[0] = Real(0.5);  // moves by a quarter
    x[1] = Real(0), g[1] = Real(4);      // held by its bound
    x[2] = Real(0.25), g[2] = Real(-8);  // as far as the bound
    g[3] = nan;
    EXPECT_EQ(projected_moves({x.data(), g.data(), scale.data(), low.data(), high.data()}, 4, out.data()),
              Real(0.75));
    EXPECT_EQ(out[0], Real(0.25));
    EXPECT_EQ(out[1], Real(0));
    EXPECT_EQ(out[2], Real(0.75));
    EXPECT_TRUE(std::isnan(out[3]));
    const std::vector<Real> a{Real(1), Real(-3), nan, Real(2)}, b{Real(1), Real(2), Real(1), Real(-2)};
    std::vector<Real> wide_a(16), wide_b(16);
    std::copy(a.begin(), a.end(), wide_a.begin());
    std::copy(b.begin(), b.end(), wide_b.begin());
    EXPECT_EQ(largest_product(wide_a.data(), wide_b.data(), 4), Real(6));
    EXPECT_EQ(largest_product(wide_a.data(), nullptr, 4), Real(3));
}

}  // namespace
}  // namespace rig
