#include "core/stabilise/similarity_2d.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"
#include "core/base/math.hpp"
#include "core/base/ranked.hpp"

namespace rig {

namespace {

constexpr int kRounds = 8;  // from thirty outliers in a hundred the weights settle in five
constexpr double kReach = 1e6;
constexpr double kMostWeight = 1e12;

bool within(const Vec2& x) {
    return x[0] >= -kReach && x[0] <= kReach && x[1] >= -kReach && x[1] <= kReach;
}

bool seen(const PlanarMarker& marker) {
    return marker.weight > 0.0 && marker.weight <= kMostWeight && within(marker.neutral) &&
           within(marker.seen);
}

using Weights = std::array<double, kMaxMarkers>;

// Least squares about the weighted centres. False when the neutral positions are one place.
bool fit_weighted(std::span<const PlanarMarker> markers, const Weights& weights, Similarity2d& fit) {
    double total = 0.0;
    Vec2 from = Vec2::Zero();
    Vec2 to = Vec2::Zero();
    for (std::size_t k = 0; k < markers.size(); ++k) {
        if (!(weights[k] > 0.0)) continue;
        total += weights[k];
        from += weights[k] * markers[k].neutral;
        to += weights[k] * markers[k].seen;
    }
    if (!(total > 0.0)) return false;
    from /= total;
    to /= total;
    double along = 0.0;
    double across = 0.0;
    double size = 0.0;
    double largest = 0.0;
    for (std::size_t k = 0; k < markers.size(); ++k) {
        if (!(weights[k] > 0.0)) continue;
        const Vec2 p = markers[k].neutral - from;
        const Vec2 q = markers[k].seen - to;
        along += weights[k] * p.dot(q);
        across += weights[k] * (p[0] * q[1] - p[1] * q[0]);
        size += weights[k] * p.dot(p);
        largest = std::max(largest, markers[k].neutral.cwiseAbs().maxCoeff());
    }
    // One place, up to the rounding of its coordinates.
    if (!(size > 1e-24 * total * (largest * largest + 1e-12))) return false;
    fit.a = along / size;
    fit.b = across / size;
    fit.shift = Vec2::Zero();
    const Vec2 shift = to - fit.apply(from);
    fit.shift = shift;
    return fit.a * fit.a + fit.b * fit.b > 0.0;
}

double distance_squared(const PlanarMarker& marker, const Similarity2d& fit) {
    const Vec2 e = marker.seen - fit.apply(marker.neutral);
    return e.dot(e);
}

// Weights about the fit; the reach is from the median distance, which half of the markers cannot move.
void weigh(std::span<const PlanarMarker> markers, const Similarity2d& fit, const Similarity2dConfig& config,
           Weights& weights, Similarity2dReport& report) {
    std::array<double, kMaxMarkers> distances{};
    std::size_t count = 0;
    for (const PlanarMarker& marker : markers) {
        if (seen(marker)) distances[count++] = std::sqrt(distance_squared(marker, fit));
    }
    const double typical = std::max(config.least_spread, median(std::span(distances).first(count)));
    const double reach2 = config.outlier_spreads * config.outlier_spreads * typical * typical;
    double total = 0.0;
    double sum = 0.0;
    report.doubted = 0;
    for (std::size_t k = 0; k < markers.size(); ++k) {
        if (!seen(markers[k])) continue;
        const double d2 = distance_squared(markers[k], fit);
        const double share = reach2 / (reach2 + d2);
        const double trust = share * share;
        weights[k] = markers[k].weight * trust;
        total += weights[k];
        sum += weights[k] * d2;
        report.doubted = static_cast<std::uint16_t>(report.doubted + (trust < 0.5 ? 1 : 0));
    }
    report.spread = std::sqrt(sum / total);
}

}  // namespace

double Similarity2d::scale() const {
    return std::sqrt(a * a + b * b);
}

double Similarity2d::turn_rad() const {
    return atan2(b, a);
}

Similarity2d fit_similarity_2d(std::span<const PlanarMarker> markers, const Similarity2dConfig& config,
                               Similarity2dReport& report) {
    RIG_CHECK(markers.size() <= kMaxMarkers);
    report = Similarity2dReport{};
    Weights weights{};
    for (std::size_t k = 0; k < markers.size(); ++k) {
        weights[k] = seen(markers[k]) ? markers[k].weight : 0.0;
        report.used = static_cast<std::uint16_t>(report.used + (weights[k] > 0.0 ? 1 : 0));
    }
    Similarity2d fit;
    for (int round = 0; round < kRounds; ++round) {
        Similarity2d next;
        if (!fit_weighted(markers, weights, next)) {
            report.ok = false;
            return {};
        }
        fit = next;
        report.ok = true;
        weigh(markers, fit, config, weights, report);
    }
    return fit;
}

}  // namespace rig
