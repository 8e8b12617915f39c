#include "firmware_host/companion/sample/curve.hpp"

#include <algorithm>
#include <cstddef>

#include "core/base/check.hpp"
#include "core/base/math.hpp"

namespace rig::host {

namespace {

double secant(std::span<const CurvePoint> points, std::size_t i) {
    return (points[i + 1].value - points[i].value) / (points[i + 1].at - points[i].at);
}

// Level where the curve turns, else the weighted harmonic mean of the two secants; the secant itself at both
// ends.
double slope(std::span<const CurvePoint> points, std::size_t i) {
    if (i == 0) return secant(points, 0);
    if (i + 1 == points.size()) return secant(points, i - 1);
    const double before = secant(points, i - 1);
    const double after = secant(points, i);
    if (before * after <= 0.0) return 0.0;
    const double h0 = points[i].at - points[i - 1].at;
    const double h1 = points[i + 1].at - points[i].at;
    const double w0 = 2.0 * h1 + h0;
    const double w1 = h1 + 2.0 * h0;
    return (w0 + w1) / (w0 / before + w1 / after);
}

}  // namespace

double curve_value(std::span<const CurvePoint> points, double at) {
    RIG_CHECK(points.size() >= 2);
    if (at <= points.front().at) return points.front().value;
    if (at >= points.back().at) return points.back().value;
    std::size_t i = 0;
    while (points[i + 1].at < at) ++i;
    const double h = points[i + 1].at - points[i].at;
    const double t = (at - points[i].at) / h;
    const double t2 = t * t;
    const double t3 = t2 * t;
    return points[i].value * (2.0 * t3 - 3.0 * t2 + 1.0) + h * slope(points, i) * (t3 - 2.0 * t2 + t) +
           points[i + 1].value * (3.0 * t2 - 2.0 * t3) + h * slope(points, i + 1) * (t3 - t2);
}

double smooth_step(double low, double high, double x) {
    const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

double gaussian(double x, double rx, double y, double ry) {
    return rig::exp(-(x / rx) * (x / rx) - (y / ry) * (y / ry));
}

}  // namespace rig::host
