// Three numbers and three by three, in double, for the simulated world alone: the world is the oracle that
// may contradict core, so it shares no arithmetic with it.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace rig::host {

using Vec3d = std::array<double, 3>;
using Mat3d = std::array<double, 9>;  // row-major

inline constexpr Mat3d kIdentity3 = {1, 0, 0, 0, 1, 0, 0, 0, 1};

[[nodiscard]] inline Vec3d operator+(const Vec3d& a, const Vec3d& b) {
    return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
[[nodiscard]] inline Vec3d operator-(const Vec3d& a, const Vec3d& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
[[nodiscard]] inline Vec3d operator*(double s, const Vec3d& a) {
    return {s * a[0], s * a[1], s * a[2]};
}
[[nodiscard]] inline double dot(const Vec3d& a, const Vec3d& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
[[nodiscard]] inline Vec3d cross(const Vec3d& a, const Vec3d& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
[[nodiscard]] inline double length(const Vec3d& a) {
    return std::sqrt(dot(a, a));
}
// The zero vector stays zero.
[[nodiscard]] inline Vec3d normalised(const Vec3d& a) {
    const double size = length(a);
    return size > 0.0 ? (1.0 / size) * a : a;
}
[[nodiscard]] inline Vec3d multiply(const Mat3d& m, const Vec3d& v) {
    return {m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
            m[6] * v[0] + m[7] * v[1] + m[8] * v[2]};
}
[[nodiscard]] inline Mat3d multiply(const Mat3d& a, const Mat3d& b) {
    Mat3d product{};
    for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 3; ++column) {
            for (std::size_t k = 0; k < 3; ++k)
                product[3 * row + column] += a[3 * row + k] * b[3 * k + column];
        }
    }
    return product;
}
[[nodiscard]] inline Mat3d transposed(const Mat3d& m) {
    return {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]};
}
// Right-handed rotation by |r| radians about r (Rodrigues).
[[nodiscard]] inline Mat3d rotation_by(const Vec3d& r_rad) {
    const double angle = length(r_rad);
    if (angle < 1e-12) return kIdentity3;
    const Vec3d axis = (1.0 / angle) * r_rad;
    const double s = std::sin(angle);
    const double c = std::cos(angle);
    const double k = 1.0 - c;
    const auto [x, y, z] = axis;
    return {c + x * x * k,     x * y * k - z * s, x * z * k + y * s, y * x * k + z * s, c + y * y * k,
            y * z * k - x * s, z * x * k - y * s, z * y * k + x * s, c + z * z * k};
}

// A 64-bit hash whose outputs for consecutive inputs look independent (SplitMix64, Steele et al. 2014).
[[nodiscard]] inline std::uint64_t mix_bits(std::uint64_t x) {
    x += 0x9E3779B97F4A7C15ULL;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ULL;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBULL;
    return x ^ (x >> 31);
}
// Uniform in [0, 1), a pure function of its three arguments.
[[nodiscard]] inline double uniform(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
    return static_cast<double>(mix_bits(mix_bits(mix_bits(seed) + stream) + index) >> 11) * 0x1.0p-53;
}

}  // namespace rig::host
