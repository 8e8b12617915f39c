// Elementary functions with the same bits on every machine: only +, -, *, / and sqrt of IEEE doubles in a
// fixed order. libm's versions differ between C libraries, so hygiene bans them in core.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/base/linalg.hpp"

namespace rig {

struct SinCos {
    double sin;
    double cos;
};

// Errors are the largest found against long double libm over grids and at random:
// tests/unit/core/base/math_test.cpp. Any x; overflows to +inf, underflows to 0, NaN stays NaN. Within 2 ulp,
// subnormal results included.
[[nodiscard]] double exp(double x);
// Absolute error <= 2.5e-16 for |radians| <= 1e4 and <= 1e-15 to 1e6; NaN beyond, and for NaN.
[[nodiscard]] SinCos sin_cos(double radians);
// (-pi, pi]; atan2(0, 0) = 0; absolute error <= 1e-15. NaN when an argument is NaN or both are infinite.
[[nodiscard]] double atan2(double y, double x);
[[nodiscard]] inline double sqrt(double x) {
    return std::sqrt(x);
}  // exact by IEEE 754
[[nodiscard]] bool is_finite(double x);

// Rotation by |r| radians about r (right-handed), and back; the result of the inverse has |r| <= pi. Elements
// within 2e-15; the round trip within 1e-13 rad to |r| = 3.1, and within 3e-7 at half a turn, where r and -r
// meet.
[[nodiscard]] Mat3 rotation_from_vector(const Vec3& r_rad);
[[nodiscard]] Vec3 vector_from_rotation(const Mat3& rotation);
// A unit vector at right angles to n, which is not zero.
[[nodiscard]] Vec3 perpendicular_to(const Vec3& n);
// Nearest rotation to a matrix that is one up to rounding (one polar Newton step repeated to convergence).
[[nodiscard]] Mat3 orthonormalised(const Mat3& nearly_rotation);

}  // namespace rig
