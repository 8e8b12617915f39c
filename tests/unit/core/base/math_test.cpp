#include "core/base/math.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "tests/support/digest.hpp"
#include "tests/support/random.hpp"

// The reference is long double libm: 64 bits of mantissa on x86-64, 113 on aarch64, either far finer than the
// bounds.
namespace rig {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kPi = 3.14159265358979323846;

using Mat3L = Eigen::Matrix<long double, 3, 3>;
using Vec3L = Eigen::Matrix<long double, 3, 1>;

double ulp_of(double x) {
    const double magnitude = std::abs(x);
    return std::nextafter(magnitude, kInfinity) - magnitude;
}

double exp_error_ulp(double x) {
    const long double expected = std::exp(static_cast<long double>(x));
    return static_cast<double>(std::abs(static_cast<long double>(exp(x)) - expected)) /
           ulp_of(static_cast<double>(expected));
}

// Of the stated range, evenly and at random, ends included.
template <class Error>
double worst_over(double low, double high, Error error) {
    constexpr int kSteps = 100000;
    test::SeededRandom random(7);
    double worst = std::max(error(low), error(high));
    for (int i = 1; i < kSteps; ++i) {
        worst = std::max(worst, error(low + (high - low) * i / kSteps));
        worst = std::max(worst, error(random.uniform(low, high)));
    }
    return worst;
}

TEST(Exp, IsWithinTwoUlp) {
    EXPECT_LE(worst_over(-708.0, 709.78, exp_error_ulp), 2.0);
    EXPECT_LE(worst_over(-1.0, 1.0, exp_error_ulp), 2.0);
    EXPECT_LE(worst_over(-1e-9, 1e-9, exp_error_ulp), 2.0);
}

TEST(Exp, IsWithinTwoUlpAmongSubnormals) {
    EXPECT_LE(worst_over(-745.1, -708.0, exp_error_ulp), 2.0);
}

TEST(Exp, HasExactAndExtremeValues) {
    EXPECT_EQ(exp(0.0), 1.0);
    EXPECT_EQ(exp(-0.0), 1.0);
    EXPECT_EQ(exp(kInfinity), kInfinity);
    EXPECT_EQ(exp(-kInfinity), 0.0);
    EXPECT_TRUE(std::isnan(exp(kNan)));
    EXPECT_EQ(exp(710.0), kInfinity);
    EXPECT_EQ(exp(1e308), kInfinity);
    EXPECT_EQ(exp(-746.0), 0.0);
    EXPECT_EQ(exp(-1e308), 0.0);
    EXPECT_GT(exp(709.78), 1e308);
    EXPECT_GT(exp(-745.1), 0.0);
}

TEST(Exp, NeverDecreases) {
    double last = 0.0;
    for (int i = -7460; i <= 7100; ++i) {
        const double value = exp(i * 0.1);
        EXPECT_GE(value, last) << i;
        last = value;
    }
}

double sin_cos_error(double x) {
    const SinCos value = sin_cos(x);
    const long double sine = std::sin(static_cast<long double>(x));
    const long double cosine = std::cos(static_cast<long double>(x));
    return static_cast<double>(std::max(std::abs(static_cast<long double>(value.sin) - sine),
                                        std::abs(static_cast<long double>(value.cos) - cosine)));
}

TEST(SinCosOf, AreWithinTheStatedError) {
    EXPECT_LE(worst_over(-1.0, 1.0, sin_cos_error), 2.5e-16);
    EXPECT_LE(worst_over(-10.0, 10.0, sin_cos_error), 2.5e-16);
    EXPECT_LE(worst_over(-1e4, 1e4, sin_cos_error), 2.5e-16);
}

TEST(SinCosOf, HoldNearMultiplesOfAQuarterTurn) {
    double worst = 0.0;
    for (int k = -6000; k <= 6000; ++k) {
        const double x = k * (kPi / 2);
        for (const double near :
             {x, std::nextafter(x, kInfinity), std::nextafter(x, -kInfinity), x + kPi / 4}) {
            worst = std::max(worst, sin_cos_error(near));
        }
    }
    EXPECT_LE(worst, 2.5e-16);
}

TEST(SinCosOf, HaveExactAndExtremeValues) {
    EXPECT_EQ(sin_cos(0.0).sin, 0.0);
    EXPECT_EQ(sin_cos(0.0).cos, 1.0);
    for (const double x : {kNan, kInfinity, -kInfinity, 1e300, -1e300, 1.1e6}) {
        EXPECT_TRUE(std::isnan(sin_cos(x).sin)) << x;
        EXPECT_TRUE(std::isnan(sin_cos(x).cos)) << x;
    }
    EXPECT_LE(sin_cos_error(9.9e5), 1e-15);
}

double atan2_error(double y, double x) {
    const long double expected = std::atan2(static_cast<long double>(y), static_cast<long double>(x));
    return static_cast<double>(std::abs(static_cast<long double>(atan2(y, x)) - expected));
}

TEST(Atan2, IsWithinTheStatedError) {
    const auto on_circle = [](double angle) { return atan2_error(std::sin(angle), std::cos(angle)); };
    EXPECT_LE(worst_over(-kPi, kPi, on_circle), 1e-15);
    const auto on_line = [](double y) { return std::max(atan2_error(y, 1.0), atan2_error(y, -1.0)); };
    EXPECT_LE(worst_over(-100.0, 100.0, on_line), 1e-15);
    test::SeededRandom random(11);
    for (int i = 0; i < 100000; ++i) {
        const double y = random.normal(0.0, 1.0) * std::ldexp(1.0, static_cast<int>(random.below(600)) - 300);
        const double x = random.normal(0.0, 1.0) * std::ldexp(1.0, static_cast<int>(random.below(600)) - 300);
        ASSERT_LE(atan2_error(y, x), 1e-15) << y << " " << x;
    }
}

TEST(Atan2, HasExactAndExtremeValues) {
    EXPECT_EQ(atan2(0.0, 0.0), 0.0);
    EXPECT_EQ(atan2(0.0, 1.0), 0.0);
    EXPECT_EQ(atan2(0.0, -1.0), kPi);
    EXPECT_EQ(atan2(-0.0, -1.0), kPi) << "the range is (-pi, pi]";
    EXPECT_EQ(atan2(1.0, 0.0), kPi / 2);
    EXPECT_EQ(atan2(-1.0, 0.0), -kPi / 2);
    EXPECT_EQ(atan2(kInfinity, 1.0), kPi / 2);
    EXPECT_EQ(atan2(1.0, -kInfinity), kPi);
    EXPECT_TRUE(std::isnan(atan2(kNan, 1.0)));
    EXPECT_TRUE(std::isnan(atan2(1.0, kNan)));
    EXPECT_TRUE(std::isnan(atan2(kInfinity, kInfinity)));
}

TEST(IsFinite, TellsNumbersFromTheRest) {
    for (const double x : {0.0, -0.0, 1.0, 5e-324, 1.7976931348623157e308, -1.7976931348623157e308})
        EXPECT_TRUE(is_finite(x)) << x;
    for (const double x : {kNan, -kNan, kInfinity, -kInfinity}) EXPECT_FALSE(is_finite(x)) << x;
    EXPECT_FALSE(is_finite(std::bit_cast<double>(std::uint64_t{0x7ff0000000000001})));
}

// Rodrigues in long double, away from the series that small angles need.
Mat3L reference_rotation(const Vec3& r_rad) {
    const Vec3L r = r_rad.cast<long double>();
    const long double angle = std::sqrt(r.dot(r));
    Mat3L cross;
    cross << 0.0L, -r[2], r[1], r[2], 0.0L, -r[0], -r[1], r[0], 0.0L;
    if (angle < 1e-5L)
        return Mat3L::Identity() + (1.0L - angle * angle / 6.0L) * cross +
               (0.5L - angle * angle / 24.0L) * cross * cross;
    const long double half = std::sin(0.5L * angle);
    return Mat3L::Identity() + std::sin(angle) / angle * cross +
           2.0L * half * half / (angle * angle) * cross * cross;
}

Vec3 random_direction(test::SeededRandom& random) {
    const Vec3 v{random.normal(0.0, 1.0), random.normal(0.0, 1.0), random.normal(0.0, 1.0)};
    return v / std::sqrt(v.dot(v));
}

template <class Matrix>
double largest(const Matrix& m) {
    return static_cast<double>(m.cwiseAbs().maxCoeff());
}

TEST(RotationFromVector, AgreesWithRodrigues) {
    test::SeededRandom random(3);
    for (const double scale : {1e-12, 1e-7, 9e-7, 1.1e-6, 1e-3, 0.1, 1.0, kPi, 6.0}) {
        for (int i = 0; i < 2000; ++i) {
            const Vec3 r = random_direction(random) * (scale * random.uniform(0.5, 1.0));
            const Mat3L error = rotation_from_vector(r).cast<long double>() - reference_rotation(r);
            ASSERT_LE(largest(error), 2e-15) << scale;
        }
    }
    EXPECT_EQ(rotation_from_vector(Vec3::Zero()), Mat3(Mat3::Identity()));
}

TEST(RotationFromVector, TurnsRightHanded) {
    const Vec3 turned = rotation_from_vector({0.0, 0.0, kPi / 2}) * Vec3(1.0, 0.0, 0.0);
    EXPECT_LE(largest(turned - Vec3(0.0, 1.0, 0.0)), 1e-15);
}

TEST(VectorFromRotation, InvertsRotationFromVector) {
    test::SeededRandom random(5);
    for (const double angle : {0.0, 1e-12, 1e-8, 1e-6, 1e-3, 0.1, 1.0, 2.0, 3.0, 3.1}) {
        for (int i = 0; i < 2000; ++i) {
            const Vec3 r = random_direction(random) * angle;
            ASSERT_LE(largest(vector_from_rotation(rotation_from_vector(r)) - r), 1e-13) << angle;
        }
    }
}

TEST(VectorFromRotation, HoldsNearHalfATurn) {
    test::SeededRandom random(9);
    for (const double short_of_half : {0.0, 1e-12, 1e-9, 5e-8, 2e-7, 1e-6, 1e-4}) {
        for (int i = 0; i < 2000; ++i) {
            const Mat3 rotation = rotation_from_vector(random_direction(random) * (kPi - short_of_half));
            const Vec3 r = vector_from_rotation(rotation);
            ASSERT_LE(std::sqrt(r.dot(r)), kPi * (1.0 + 1e-15));
            // Compared as rotations: r and -r are the same half turn.
            ASSERT_LE(largest(rotation_from_vector(r) - rotation), 3e-7) << short_of_half;
        }
    }
}

TEST(Orthonormalised, FindsTheNearestRotation) {
    test::SeededRandom random(13);
    for (const double size : {0.0, 1e-12, 1e-6, 1e-2, 0.1}) {
        for (int i = 0; i < 2000; ++i) {
            Mat3 m = rotation_from_vector(random_direction(random) * random.uniform(0.0, kPi));
            for (int k = 0; k < 9; ++k) m(k / 3, k % 3) += random.uniform(-size, size);
            const Mat3 r = orthonormalised(m);
            ASSERT_LE(largest(r.transpose() * r - Mat3::Identity()), 2e-15);
            ASSERT_GT(r.determinant(), 0.0);
            // m = r s with s symmetric is the polar decomposition, whose r is the nearest rotation.
            const Mat3 s = r.transpose() * m;
            ASSERT_LE(largest(s - s.transpose()), 2e-15);
        }
    }
}

// Equal bits on every machine, compiler option and C library: the digest of a fixed sweep is part of the
// contract. A change of these functions changes what recorded takes re-solve to, and has to be meant.
TEST(Math, HasTheSameBitsEverywhere) {
    test::Digest digest;
    test::SeededRandom random(17);
    for (int i = 0; i < 20000; ++i) {
        digest.add(exp(random.uniform(-740.0, 710.0)));
        const SinCos turn = sin_cos(random.uniform(-100.0, 100.0));
        digest.add(turn.sin).add(turn.cos);
        const double y =
            random.uniform(-1.0, 1.0);  // one draw a statement: compilers order arguments differently
        const double x = random.uniform(-1.0, 1.0);
        digest.add(atan2(y, x));
        const Vec3 direction = random_direction(random);
        const Mat3 rotation = rotation_from_vector(direction * random.uniform(0.0, 3.0));
        digest.add(std::span<const double>(rotation.data(), 9));
        const Vec3 back = vector_from_rotation(orthonormalised(rotation));
        digest.add(std::span<const double>(back.data(), 3));
    }
    EXPECT_EQ(digest.value(), 15649997170650286085ULL);
}

}  // namespace
}  // namespace rig
