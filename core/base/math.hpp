// Elementary functions with the same bits on every machine: only +, -, *, / and sqrt of IEEE doubles in a fixed
// order. libm's versions differ between C libraries, so hygiene bans them in core.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/base/linalg.hpp"

namespace rig {

struct SinCos {
    double sin;
    double cos;
};

// Largest error against the correctly rounded value over the stated range: see tests/unit/core/base/math_test.cpp.
[[nodiscard]] double exp(double x);           // any x; overflows to +inf, underflows to 0, NaN stays NaN; <= 2 ulp
[[nodiscard]] SinCos sin_cos(double radians);  // |radians| <= 1e4; abs error <= 1e-12
[[nodiscard]] double atan2(double y, double x);  // (-pi, pi]; atan2(0, 0) = 0; abs error <= 1e-15 * few
[[nodiscard]] inline double sqrt(double x) { return std::sqrt(x); }  // exact by IEEE 754
[[nodiscard]] bool is_finite(double x);

// Rotation by |r| radians about r (right-handed), and back; the result of the inverse has |r| <= pi.
[[nodiscard]] Mat3 rotation_from_vector(const Vec3& r_rad);
[[nodiscard]] Vec3 vector_from_rotation(const Mat3& rotation);
// Nearest rotation to a matrix that is one up to rounding (one polar Newton step repeated to convergence).
[[nodiscard]] Mat3 orthonormalised(const Mat3& nearly_rotation);

}  // namespace rig
