#include "core/base/float_kernels.hpp"

#include <gtest/gtest.h>

#include <cmath>
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

}  // namespace
}  // namespace rig
