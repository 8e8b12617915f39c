#include "core/base/math.hpp"

#include <array>
#include <bit>
#include <limits>

namespace rig {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kLn2High =
    6.93147180369123816490e-01;  // ln 2 split so that k * high is exact for |k| < 2^20
constexpr double kLn2Low = 1.90821492927058770002e-10;
constexpr double kInvLn2 = 1.44269504088896338700;
constexpr double kHalfPiHigh =
    1.57079632673412561417e+00;  // pi / 2 in three parts, each product with k exact
constexpr double kHalfPiMid = 6.07710050630396597660e-11;
constexpr double kHalfPiLow = 2.02226624879595063154e-21;

constexpr double kMaxRadians = 1e6;

double round_to_nearest(double x) {
    constexpr double kShift = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to an integer
    return (x + kShift) - kShift;
}

double scale_by_power_of_two(double x, int k) {
    // Two steps keep subnormal results correctly scaled.
    const int half = k / 2;
    const auto power = [](int e) {
        return std::bit_cast<double>(static_cast<std::uint64_t>(e + 1023) << 52);
    };
    return x * power(half) * power(k - half);
}

double sin_polynomial(double x) {
    // Taylor to x^17 on |x| <= pi/4: truncation under 1e-17.
    constexpr std::array<double, 8> kC{
        -1.0 / 6,        1.0 / 120,        -1.0 / 5040,          1.0 / 362880,
        -1.0 / 39916800, 1.0 / 6227020800, -1.0 / 1307674368000, 1.0 / 355687428096000};
    const double x2 = x * x;
    double sum = 0.0;
    for (std::size_t i = kC.size(); i-- > 0;) sum = (sum + kC[i]) * x2;
    return x + x * sum;
}

double cos_polynomial(double x) {
    constexpr std::array<double, 8> kC{
        -1.0 / 2,       1.0 / 24,        -1.0 / 720,         1.0 / 40320,
        -1.0 / 3628800, 1.0 / 479001600, -1.0 / 87178291200, 1.0 / 20922789888000};
    const double x2 = x * x;
    double sum = 0.0;
    for (std::size_t i = kC.size(); i-- > 0;) sum = (sum + kC[i]) * x2;
    return 1.0 + sum;
}

double atan_small(double x) {
    // |x| <= tan(pi/16): series to x^33, truncation under 1e-25.
    const double x2 = x * x;
    double sum = 0.0;
    for (int k = 16; k >= 1; --k) sum = ((k % 2 == 0 ? 1.0 : -1.0) / (2 * k + 1) + sum) * x2;
    return x + x * sum;
}

double atan_unit(double x) {
    // 0 <= x <= 1: halve the angle twice, tan(a/2) = t / (1 + sqrt(1 + t^2)).
    const double half = x / (1.0 + std::sqrt(1.0 + x * x));
    const double quarter = half / (1.0 + std::sqrt(1.0 + half * half));
    return 4.0 * atan_small(quarter);
}

}  // namespace

bool is_finite(double x) {
    return (std::bit_cast<std::uint64_t>(x) & 0x7ff0000000000000ULL) != 0x7ff0000000000000ULL;
}

double exp(double x) {
    if (x != x) return x;
    if (x > 709.782712893384) return std::numeric_limits<double>::infinity();
    if (x < -745.2) return 0.0;
    const double k = round_to_nearest(x * kInvLn2);
    const double r = (x - k * kLn2High) - k * kLn2Low;  // |r| <= ln2 / 2
    double sum = 0.0;
    for (int i = 14; i >= 1; --i) sum = (sum + 1.0) * (r / i);  // Taylor, truncation under 1e-18
    return scale_by_power_of_two(1.0 + sum, static_cast<int>(k));
}

SinCos sin_cos(double radians) {
    // Beyond, the products with the parts of pi / 2 are not exact any more, and far beyond k is no integer.
    if (!(radians >= -kMaxRadians && radians <= kMaxRadians)) {
        return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
    }
    const double k = round_to_nearest(radians * (2.0 / kPi));
    const double r = ((radians - k * kHalfPiHigh) - k * kHalfPiMid) - k * kHalfPiLow;
    const double s = sin_polynomial(r);
    const double c = cos_polynomial(r);
    switch (static_cast<std::int64_t>(k) & 3) {
        case 0:
            return {s, c};
        case 1:
            return {c, -s};
        case 2:
            return {-s, -c};
        default:
            return {-c, s};
    }
}

double atan2(double y, double x) {
    const double ax = x < 0 ? -x : x;
    const double ay = y < 0 ? -y : y;
    if (ax == 0.0 && ay == 0.0) return 0.0;
    double angle = ay <= ax ? atan_unit(ay / ax) : kPi / 2 - atan_unit(ax / ay);
    if (x < 0) angle = kPi - angle;
    return y < 0 ? -angle : angle;
}

Mat3 rotation_from_vector(const Vec3& r_rad) {
    const double angle = std::sqrt(r_rad.dot(r_rad));
    Mat3 cross;
    cross << 0.0, -r_rad[2], r_rad[1], r_rad[2], 0.0, -r_rad[0], -r_rad[1], r_rad[0], 0.0;
    double a = 1.0;  // sin(angle) / angle
    double b = 0.5;  // (1 - cos(angle)) / angle^2
    if (angle > 1e-6) {
        const SinCos half = sin_cos(0.5 * angle);
        a = 2.0 * half.sin * half.cos / angle;
        b = 2.0 * half.sin * half.sin / (angle * angle);
    }
    const Mat3 square = cross * cross;
    return Mat3::Identity() + a * cross + b * square;
}

Vec3 vector_from_rotation(const Mat3& rotation) {
    const Vec3 axis_sin{0.5 * (rotation(2, 1) - rotation(1, 2)), 0.5 * (rotation(0, 2) - rotation(2, 0)),
                        0.5 * (rotation(1, 0) - rotation(0, 1))};
    const double sine = std::sqrt(axis_sin.dot(axis_sin));
    const double cosine = 0.5 * (rotation(0, 0) + rotation(1, 1) + rotation(2, 2) - 1.0);
    const double angle = atan2(sine, cosine);
    if (sine > 1e-7) return axis_sin * (angle / sine);
    if (cosine > 0.0) return axis_sin;
    // Half a turn: the axis is the largest column of (R + I) / 2.
    const Mat3 outer = 0.5 * (rotation + Mat3::Identity());
    int column = 0;
    for (int i = 1; i < 3; ++i) {
        if (outer(i, i) > outer(column, column)) column = i;
    }
    const Vec3 axis = outer.col(column) / std::sqrt(outer(column, column));
    return axis * angle;
}

Vec3 perpendicular_to(const Vec3& n) {
    const Vec3 aside = n.x() * n.x() < 0.5 * n.squaredNorm() ? Vec3(1.0, 0.0, 0.0) : Vec3(0.0, 1.0, 0.0);
    const Vec3 across = n.cross(aside);
    return across / sqrt(across.squaredNorm());
}

Mat3 orthonormalised(const Mat3& nearly_rotation) {
    Mat3 r = nearly_rotation;
    for (int i = 0; i < 12; ++i) {
        const Mat3 gram = r.transpose() * r;
        const Mat3 correction = 1.5 * Mat3::Identity() - 0.5 * gram;
        r = (r * correction).eval();
    }
    return r;
}

}  // namespace rig
