#include "core/base/float_kernels.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/random.hpp"

namespace rig {
namespace {

std::vector<float> numbers(std::size_t count, test::SeededRandom& random) {
    std::vector<float> out(count);
    for (float& x : out) x = static_cast<float>(random.normal(0.0, 1.0));
    return out;
}

struct alignas(64) Lanes {
    float values[kLaneFloats];
};

// Rows in memory that starts at a cache line.
class Block {
  public:
    explicit Block(std::size_t floats) : lanes_(floats / kLaneFloats) {}
    [[nodiscard]] float* data() { return lanes_.data()->values; }

  private:
    std::vector<Lanes> lanes_;
};

TEST(FloatKernels, CombinesRowsInTheOrderOfTheTerms) {
    test::SeededRandom random(1);
    for (const std::size_t n : {16U, 48U, 208U, 256U}) {
        for (const std::size_t count : {0U, 1U, 7U, 60U}) {
            Block rows((count + 1) * n);
            for (std::size_t i = 0; i < count * n; ++i)
                rows.data()[i] = static_cast<float>(random.normal(0.0, 1.0));
            const std::vector<float> c = numbers(count, random);
            Block start(n);
            Block out(n);
            for (std::size_t i = 0; i < n; ++i) start.data()[i] = static_cast<float>(random.normal(0.0, 1.0));
            combine_rows(rows.data(), n, c.data(), count, n, start.data(), out.data());
            for (std::size_t i = 0; i < n; ++i) {
                float wanted = start.data()[i];
                for (std::size_t r = 0; r < count; ++r) wanted = wanted + c[r] * rows.data()[r * n + i];
                ASSERT_EQ(out.data()[i], wanted) << n << " " << count << " " << i;
            }
        }
    }
}

TEST(FloatKernels, CombinesChosenRows) {
    test::SeededRandom random(2);
    constexpr std::size_t kWidth = 32;
    Block rows(10 * kWidth);
    for (std::size_t i = 0; i < 10 * kWidth; ++i)
        rows.data()[i] = static_cast<float>(random.normal(0.0, 1.0));
    const std::vector<std::uint16_t> index{9, 0, 4};
    const std::vector<float> c = numbers(3, random);
    Block out(kWidth);
    combine_rows(rows.data(), kWidth, index.data(), c.data(), 3, kWidth, nullptr, out.data());
    for (std::size_t i = 0; i < kWidth; ++i) {
        float wanted = 0.0F;
        for (std::size_t r = 0; r < 3; ++r) wanted = wanted + c[r] * rows.data()[index[r] * kWidth + i];
        ASSERT_EQ(out.data()[i], wanted);
    }
}

TEST(FloatKernels, DotIsWithinItsRounding) {
    test::SeededRandom random(3);
    for (const std::size_t n : {16U, 64U, 272U}) {
        const std::vector<float> a = numbers(n, random);
        const std::vector<float> b = numbers(n, random);
        long double wanted = 0.0L;
        long double size = 0.0L;
        for (std::size_t i = 0; i < n; ++i) {
            const long double term = static_cast<long double>(a[i]) * static_cast<long double>(b[i]);
            wanted += term;
            size += std::fabs(term);
        }
        const auto got = static_cast<long double>(dot(a.data(), b.data(), n));
        EXPECT_LE(std::fabs(got - wanted), size * static_cast<long double>(n / kLaneFloats + 5) * 0x1p-24L);
    }
}

TEST(FloatKernels, AddsAnOuterProductSymmetrically) {
    test::SeededRandom random(4);
    for (const std::size_t k : {1U, 15U, 16U, 40U}) {
        const std::size_t stride = padded(k);
        Block m(stride * stride);
        Block u(stride);
        for (std::size_t i = 0; i < k; ++i) u.data()[i] = static_cast<float>(random.normal(0.0, 1.0));
        add_outer(m.data(), stride, k, 0.37F, u.data());
        add_outer(m.data(), stride, k, -1.4F, u.data());
        for (std::size_t i = 0; i < k; ++i) {
            for (std::size_t j = 0; j < k; ++j) {
                const float product = u.data()[i] * u.data()[j];
                ASSERT_EQ(m.data()[i * stride + j], 0.37F * product + -1.4F * product);
                ASSERT_EQ(m.data()[i * stride + j], m.data()[j * stride + i]);
            }
        }
    }
}

}  // namespace
}  // namespace rig
