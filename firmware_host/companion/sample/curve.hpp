// Smooth curves through tables of points: shape-preserving cubics that never overshoot their points.
#pragma once

#include <span>

namespace rig::host {

struct CurvePoint {
    double at;
    double value;
};

// Monotone piecewise cubic Hermite curve (Fritsch and Butland 1984, as SciPy's PCHIP inside). Points are
// sorted by rising `at`, at least two; constant beyond both ends.
[[nodiscard]] double curve_value(std::span<const CurvePoint> points, double at);

// 0 below `low`, 1 above `high`, with level ends; low < high.
[[nodiscard]] double smooth_step(double low, double high, double x);

// exp(-(x/rx)^2 - (y/ry)^2)
[[nodiscard]] double gaussian(double x, double rx, double y, double ry);

}  // namespace rig::host
