#include "core/base/dense.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/base/float_kernels.hpp"
#include "tests/support/random.hpp"

namespace rig {
namespace {

using Matrix = std::vector<double>;

// A^T A + shift I with random A, rows `stride` apart, NaN outside the lower triangle: nothing else may be
// read.
Matrix positive_definite(std::size_t n, std::size_t stride, double shift, test::SeededRandom& random) {
    Matrix a(n * n);
    for (double& x : a) x = random.normal(0.0, 1.0);
    Matrix gram(n * stride, std::numeric_limits<double>::quiet_NaN());
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j <= i; ++j) {
            double sum = i == j ? shift : 0.0;
            for (std::size_t k = 0; k < n; ++k) sum += a[k * n + i] * a[k * n + j];
            gram[i * stride + j] = sum;
        }
    }
    return gram;
}

double symmetric_entry(const Matrix& a, std::size_t stride, std::size_t i, std::size_t j) {
    return i >= j ? a[i * stride + j] : a[j * stride + i];
}

TEST(Dense, DotAndAddScaledMatchLongDouble) {
    test::SeededRandom random(3);
    for (std::size_t n = 0; n < 40; ++n) {
        std::vector<double> a(n);
        std::vector<double> b(n);
        long double sum = 0.0L;
        long double size = 0.0L;
        for (std::size_t i = 0; i < n; ++i) {
            a[i] = random.normal(0.0, 1.0);
            b[i] = random.normal(0.0, 1.0);
            sum += static_cast<long double>(a[i]) * static_cast<long double>(b[i]);
            size += std::fabs(static_cast<long double>(a[i]) * static_cast<long double>(b[i]));
        }
        EXPECT_NEAR(dot(a.data(), b.data(), n), static_cast<double>(sum),
                    1e-15 * static_cast<double>(size) * 4.0)
            << n;
        std::vector<double> y = b;
        add_scaled(y.data(), 0.5, a.data(), n);
        for (std::size_t i = 0; i < n; ++i) EXPECT_EQ(y[i], b[i] + 0.5 * a[i]);
    }
}

TEST(Dense, DotSumsInTheStatedOrder) {
    // 1 is lost beside 1e16 in a partial sum, but not beside nothing: the result tells the order.
    const std::vector<double> a{1e16, 1.0, -1e16, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0};
    const std::vector<double> ones(9, 1.0);
    const double s0 = (1e16 + 1.0) + 1.0;
    const double expected = (s0 + 2.0) + (-1e16 + 2.0);
    EXPECT_EQ(dot(a.data(), ones.data(), 9), expected);
}

TEST(Dense, CholeskyReproducesTheMatrixAndSolves) {
    test::SeededRandom random(5);
    for (const std::size_t n : {1U, 2U, 3U, 7U, 16U, 53U}) {
        const std::size_t stride = n + 3;
        const Matrix a = positive_definite(n, stride, 0.5, random);
        Matrix l(n * stride, 0.0);
        ASSERT_TRUE(cholesky(a.data(), l.data(), n, stride));
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = 0; j <= i; ++j) {
                long double sum = 0.0L;
                for (std::size_t k = 0; k <= j; ++k) {
                    sum += static_cast<long double>(l[i * stride + k]) *
                           static_cast<long double>(l[j * stride + k]);
                }
                EXPECT_NEAR(static_cast<double>(sum), a[i * stride + j], 1e-13 * static_cast<double>(n + 4));
            }
        }
        std::vector<double> x(n);
        for (double& value : x) value = random.normal(0.0, 1.0);
        std::vector<double> right(n);
        for (std::size_t i = 0; i < n; ++i) {
            long double sum = 0.0L;
            for (std::size_t j = 0; j < n; ++j) {
                sum += static_cast<long double>(symmetric_entry(a, stride, i, j)) *
                       static_cast<long double>(x[j]);
            }
            right[i] = static_cast<double>(sum);
        }
        solve_lower(l.data(), n, stride, right.data());
        solve_lower_transposed(l.data(), n, stride, right.data());
        for (std::size_t i = 0; i < n; ++i) EXPECT_NEAR(right[i], x[i], 1e-11);
    }
}

TEST(Dense, CholeskyInPlaceGivesTheSameFactor) {
    test::SeededRandom random(6);
    const std::size_t n = 20;
    Matrix a = positive_definite(n, n, 0.1, random);
    Matrix l(n * n, 0.0);
    ASSERT_TRUE(cholesky(a.data(), l.data(), n, n));
    ASSERT_TRUE(cholesky(a.data(), a.data(), n, n));
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j <= i; ++j) EXPECT_EQ(a[i * n + j], l[i * n + j]);
    }
}

TEST(Dense, SymmetricInverseMatchesColumnSolves) {
    test::SeededRandom random(7);
    for (const std::size_t n : {std::size_t{1}, std::size_t{16}, std::size_t{31}, std::size_t{53}}) {
        const std::size_t stride = row_stride(n);
        const Matrix a = positive_definite(n, stride, 0.2, random);
        Matrix l(n * stride, 0.0);
        ASSERT_TRUE(cholesky(a.data(), l.data(), n, stride));
        Matrix inverse(n * stride, 7.0);
        std::vector<double> scratch(n);
        symmetric_inverse(l.data(), n, stride, inverse.data(), scratch.data());
        for (std::size_t i = 0; i < n; ++i) {
            std::vector<double> column(n, 0.0);
            column[i] = 1.0;
            solve_lower(l.data(), n, stride, column.data());
            solve_lower_transposed(l.data(), n, stride, column.data());
            for (std::size_t j = 0; j < n; ++j) {
                EXPECT_NEAR(inverse[i * stride + j], column[j], 1e-12 * column[i] + 1e-14);
                EXPECT_EQ(inverse[i * stride + j], inverse[j * stride + i]);
            }
            for (std::size_t j = n; j < padded(n); ++j) EXPECT_EQ(inverse[i * stride + j], 0.0);
        }
    }
}

TEST(Dense, InverseOfFactorTimesTheFactorIsOne) {
    test::SeededRandom random(61);
    for (const std::size_t n : {1U, 2U, 7U, 16U, 17U, 33U, 54U, 96U}) {
        const std::size_t stride = n + kLaneFloats + 3;
        const Matrix gram = positive_definite(n, stride, 0.5, random);
        Matrix a(n * stride, 3.0);
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = 0; j <= i; ++j) a[j * stride + i] = gram[i * stride + j];
        }
        Matrix inverse(n * stride, 7.0);
        std::vector<double> scratch(n);
        ASSERT_TRUE(inverse_of_factor(a.data(), n, stride, inverse.data(), scratch.data()));
        // L^-1 A L^-T = I
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = 0; j < n; ++j) {
                long double sum = 0.0L;
                for (std::size_t k = 0; k < n; ++k) {
                    long double row = 0.0L;
                    for (std::size_t l = 0; l < n; ++l) {
                        const double g = k >= l ? gram[k * stride + l] : gram[l * stride + k];
                        row +=
                            static_cast<long double>(g) * static_cast<long double>(inverse[j * stride + l]);
                    }
                    sum += static_cast<long double>(inverse[i * stride + k]) * row;
                }
                EXPECT_NEAR(static_cast<double>(sum), i == j ? 1.0 : 0.0, 1e-9) << n << " " << i << " " << j;
            }
            for (std::size_t j = i + 1; j < padded(n); ++j) EXPECT_EQ(inverse[i * stride + j], 0.0);
        }
    }
}

TEST(Dense, InverseOfFactorRefusesWhatIsNotPositiveDefinite) {
    constexpr std::size_t kStride = 3 + kLaneFloats;
    Matrix inverse(3 * kStride);
    std::vector<double> scratch(3);
    for (const double last : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
        Matrix a(3 * kStride, 0.0);
        a[0] = a[kStride + 1] = 1.0;
        a[2 * kStride + 2] = last;
        EXPECT_FALSE(inverse_of_factor(a.data(), 3, kStride, inverse.data(), scratch.data())) << last;
    }
}

// The last rows may be done again, with another diagonal, on those above them.
TEST(Dense, UpperFactorGoesOnWhereItStopped) {
    test::SeededRandom random(63);
    for (const std::size_t n : {7U, 17U, 54U}) {
        const std::size_t stride = n + kLaneFloats;
        const Matrix gram = positive_definite(n, stride, 0.5, random);
        Matrix whole(n * stride, 0.0);
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = 0; j <= i; ++j) whole[j * stride + i] = gram[i * stride + j];
        }
        Matrix parts = whole;
        const std::size_t from = n - 6;
        for (std::size_t i = from; i < n; ++i) whole[i * stride + i] += 3.0;
        std::vector<double> scratch(n);
        const Matrix rest(parts.begin() + static_cast<std::ptrdiff_t>(from * stride), parts.end());
        ASSERT_TRUE(upper_factor(parts.data(), 0, n, n, stride, scratch.data()));
        std::copy(rest.begin(), rest.end(), parts.begin() + static_cast<std::ptrdiff_t>(from * stride));
        for (std::size_t i = from; i < n; ++i) parts[i * stride + i] += 3.0;
        ASSERT_TRUE(upper_factor(parts.data(), from, n, n, stride, scratch.data()));
        ASSERT_TRUE(upper_factor(whole.data(), 0, n, n, stride, scratch.data()));
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = i; j < n; ++j) EXPECT_EQ(parts[i * stride + j], whole[i * stride + j]);
        }
    }
}

TEST(Dense, CholeskyRefusesWhatIsNotPositiveDefinite) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinity = std::numeric_limits<double>::infinity();
    Matrix l(4, 0.0);
    EXPECT_FALSE(cholesky(Matrix{1.0, 0.0, 2.0, 1.0}.data(), l.data(), 2, 2)) << "indefinite";
    EXPECT_FALSE(cholesky(Matrix{1.0, 0.0, 1.0, 1.0}.data(), l.data(), 2, 2)) << "singular";
    EXPECT_FALSE(cholesky(Matrix{-1.0, 0.0, 0.0, -1.0}.data(), l.data(), 2, 2)) << "negative";
    EXPECT_FALSE(cholesky(Matrix{0.0, 0.0, 0.0, 0.0}.data(), l.data(), 2, 2)) << "zero";
    EXPECT_FALSE(cholesky(Matrix{nan, 0.0, 0.0, 1.0}.data(), l.data(), 2, 2)) << "NaN on the diagonal";
    EXPECT_FALSE(cholesky(Matrix{1.0, 0.0, nan, 1.0}.data(), l.data(), 2, 2)) << "NaN beside the diagonal";
    EXPECT_FALSE(cholesky(Matrix{infinity, 0.0, 0.0, 1.0}.data(), l.data(), 2, 2)) << "infinite";
    EXPECT_FALSE(cholesky(Matrix{1.0, 0.0, 0.0, 1e-15}.data(), l.data(), 2, 2)) << "pivot under the floor";
    EXPECT_TRUE(cholesky(Matrix{1.0, 0.0, 0.0, 1e-13}.data(), l.data(), 2, 2)) << "pivot above the floor";
    EXPECT_TRUE(cholesky(Matrix{1.0, 0.0, 0.0, 1e-15}.data(), l.data(), 2, 2, 1e-16))
        << "a lower floor was asked for";
}

TEST(Dense, EigenvectorsDiagonalise) {
    test::SeededRandom random(11);
    for (const std::size_t n : {1U, 2U, 5U, 24U, 60U}) {
        const std::size_t stride = n + 2;
        const Matrix lower = positive_definite(n, stride, 0.0, random);
        Matrix a(n * stride, 0.0);
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = 0; j < n; ++j) a[i * stride + j] = symmetric_entry(lower, stride, i, j);
        }
        Matrix destroyed = a;
        std::vector<double> values(n);
        Matrix vectors(n * stride, 0.0);
        symmetric_eigen(destroyed.data(), n, stride, values.data(), vectors.data());
        for (std::size_t j = 1; j < n; ++j) EXPECT_GE(values[j - 1], values[j]);
        for (std::size_t j = 0; j < n; ++j) {
            for (std::size_t i = 0; i < n; ++i) {
                long double product = 0.0L;
                for (std::size_t k = 0; k < n; ++k) {
                    product += static_cast<long double>(a[i * stride + k]) *
                               static_cast<long double>(vectors[k * stride + j]);
                }
                const double residual = static_cast<double>(product) - values[j] * vectors[i * stride + j];
                EXPECT_NEAR(residual, 0.0, 1e-12 * values[0]) << n << ' ' << i << ' ' << j;
                long double inner = 0.0L;
                for (std::size_t k = 0; k < n; ++k) {
                    inner += static_cast<long double>(vectors[k * stride + i]) *
                             static_cast<long double>(vectors[k * stride + j]);
                }
                EXPECT_NEAR(static_cast<double>(inner), i == j ? 1.0 : 0.0, 1e-12);
            }
        }
    }
}

TEST(Dense, EigenvaluesOfAKnownMatrix) {
    // Eigenvalues of the path matrix tridiag(-1, 2, -1): 2 - 2 cos(pi j / (n + 1)).
    const std::size_t n = 12;
    Matrix a(n * n, 0.0);
    for (std::size_t i = 0; i < n; ++i) {
        a[i * n + i] = 2.0;
        if (i + 1 < n) a[i * n + i + 1] = a[(i + 1) * n + i] = -1.0;
    }
    std::vector<double> values(n);
    Matrix vectors(n * n);
    symmetric_eigen(a.data(), n, n, values.data(), vectors.data());
    const double pi = std::acos(-1.0);
    for (std::size_t j = 0; j < n; ++j) {
        const double expected =
            2.0 - 2.0 * std::cos(pi * static_cast<double>(n - j) / static_cast<double>(n + 1));
        EXPECT_NEAR(values[j], expected, 1e-13);
    }
}

TEST(Dense, EigenOfZeroAndRepeatedValues) {
    const std::size_t n = 6;
    Matrix zero(n * n, 0.0);
    std::vector<double> values(n, 7.0);
    Matrix vectors(n * n);
    symmetric_eigen(zero.data(), n, n, values.data(), vectors.data());
    for (const double value : values) EXPECT_EQ(value, 0.0);
    Matrix identity(n * n, 0.0);
    for (std::size_t i = 0; i < n; ++i) identity[i * n + i] = 3.0;
    symmetric_eigen(identity.data(), n, n, values.data(), vectors.data());
    for (const double value : values) EXPECT_EQ(value, 3.0);
}

}  // namespace
}  // namespace rig
