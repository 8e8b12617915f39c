#include "core/base/float_kernels.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/random.hpp"

namespace rig {
namespace {

std::vector<float> random_floats(test::SeededRandom& random, std::size_t count) {
    std::vector<float> out(count);
    for (float& x : out) x = static_cast<float>(random.normal(0.0, 1.0));
    return out;
}

TEST(CombineRows, SumsInTheOrderOfTheRows) {
    test::SeededRandom random(21);
    for (const std::size_t n : {16U, 48U, 144U, 256U}) {
        const std::size_t count = 1 + random.below(100);
        const std::vector<float> rows = random_floats(random, count * n);
        const std::vector<float> coefficient = random_floats(random, count);
        const std::vector<float> start = random_floats(random, n);
        std::vector<std::uint16_t> index;
        for (std::size_t r = 0; r < count; r += 2) index.push_back(static_cast<std::uint16_t>(r));
        std::vector<float> all(n);
        std::vector<float> some(n);
        combine_rows(rows.data(), n, coefficient.data(), count, n, start.data(), all.data());
        combine_rows(rows.data(), n, index.data(), coefficient.data(), index.size(), n, nullptr, some.data());
        for (std::size_t c = 0; c < n; ++c) {
            double wanted = static_cast<double>(start[c]);
            for (std::size_t r = 0; r < count; ++r)
                wanted += static_cast<double>(coefficient[r]) * static_cast<double>(rows[r * n + c]);
            ASSERT_NEAR(static_cast<double>(all[c]), wanted, 1e-4);
            double wanted_some = 0.0;
            for (std::size_t k = 0; k < index.size(); ++k)
                wanted_some +=
                    static_cast<double>(coefficient[k]) * static_cast<double>(rows[index[k] * n + c]);
            ASSERT_NEAR(static_cast<double>(some[c]), wanted_some, 1e-4);
        }
    }
}

TEST(FloatDot, AgreesWithDouble) {
    test::SeededRandom random(22);
    for (const std::size_t n : {16U, 112U, 320U}) {
        const std::vector<float> a = random_floats(random, n);
        const std::vector<float> b = random_floats(random, n);
        double wanted = 0.0;
        for (std::size_t i = 0; i < n; ++i) wanted += static_cast<double>(a[i]) * static_cast<double>(b[i]);
        EXPECT_NEAR(static_cast<double>(dot(a.data(), b.data(), n)), wanted, 2e-5);
    }
}

TEST(AddOuter, StaysSymmetricToTheBit) {
    test::SeededRandom random(23);
    constexpr std::size_t kSize = 20;
    constexpr std::size_t kStride = padded(kSize);
    std::vector<float> m(kSize * kStride);
    std::vector<double> wanted(kSize * kSize);
    for (int update = 0; update < 10; ++update) {
        std::vector<float> u = random_floats(random, kSize);
        u.resize(kStride);
        const auto factor = static_cast<float>(random.normal(0.0, 1.0));
        add_outer(m.data(), kStride, kSize, factor, u.data());
        for (std::size_t r = 0; r < kSize; ++r) {
            for (std::size_t c = 0; c < kSize; ++c)
                wanted[r * kSize + c] +=
                    static_cast<double>(factor) * static_cast<double>(u[r]) * static_cast<double>(u[c]);
        }
    }
    for (std::size_t r = 0; r < kSize; ++r) {
        for (std::size_t c = 0; c < kSize; ++c) {
            EXPECT_EQ(m[r * kStride + c], m[c * kStride + r]);
            EXPECT_NEAR(static_cast<double>(m[r * kStride + c]), wanted[r * kSize + c], 1e-4);
        }
    }
}

}  // namespace
}  // namespace rig
