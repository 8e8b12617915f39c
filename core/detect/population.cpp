#include "core/detect/population.hpp"

#include <algorithm>
#include <array>

#include "core/base/math.hpp"
#include "core/base/ranked.hpp"

namespace rig {

namespace {

constexpr double kShownHalf = 4.4;    // short axis^2 / edge^2 at which half the depth is seen at the core
constexpr double kLeastEdge = 1.0;    // px^2: pixels themselves are that wide
constexpr double kWide = 0.95;        // shown depth of a marker that shows all of it
constexpr double kFreeSpreads = 2.5;  // of size, that cost next to nothing, within these bounds:
constexpr double kLeastFreeSize = 0.15;
constexpr double kMostFreeSize = 0.3;
constexpr double kSizeSlope = 0.2;  // what next to nothing is
constexpr double kFlattest =
    0.33;  // short axis / size that a disc can be seen at; what is flatter is cut off:
constexpr double kFlatSpread = 0.1;  // one unit of badness
constexpr double kLeastDepthSpread = 0.02;
constexpr double kUnknownDepthSpread = 0.1;
constexpr double kPartLack = 0.5;       // of a completed marker: what lies on it takes depth
constexpr double kExcessSpread = 0.12;  // of ink's depth: one unit of badness
constexpr double kFreeSlopeSpreads = 2.0;
constexpr double kLeastFreeSlope = 0.03;
constexpr double kSlopeSpread = 0.06;  // of the slope: one unit of badness
constexpr double kSlopeNoise = 0.8;  // standard deviations of the slope, per noise / contrast, and twice that
constexpr double kAloneOpen = 0.03;
constexpr double kRetroLack = 0.62;       // of the paint's depth: what angles explain; beyond it,
constexpr double kRetroLackSpread = 0.2;  // one unit of badness more

double spread_about(double centre, std::span<float> values) {
    for (float& value : values) {
        const double off = static_cast<double>(value) - centre;
        value = static_cast<float>(off < 0.0 ? -off : off);
    }
    return 1.5 * median(values);
}

// A hole fades where ink ends: badness of an edge less steep than the others'.
double softness(const Population& p, const Blob& blob) {
    // Where something lies on it or beside it, there are other edges.
    const bool alone = !blob.completed && !blob.hidden && blob.open < kAloneOpen;
    if (!alone || !(p.slope > 0.0) || !(blob.slope != 0.0)) return 0.0;
    const double free = std::max(kFreeSlopeSpreads * p.slope_spread, kLeastFreeSlope);
    const double lack = 1.0 - blob.slope / p.slope - free - kSlopeNoise / std::max(blob.snr, 1.0);
    return std::max(0.0, lack) / kSlopeSpread;
}

}  // namespace

double edge_square_px2(const Blob& blob) {
    return blob.long_axis_px * blob.short_axis_px - blob.diameter_px * blob.diameter_px;
}

double shown_depth(double short_axis_px, double edge_px2) {
    const double width = short_axis_px * short_axis_px / (kShownHalf * std::max(edge_px2, kLeastEdge));
    const double cube = width * width * width;
    return cube / (1.0 + cube);
}

Population population_of(std::span<const Blob> blobs, std::size_t quorum) {
    std::array<float, kMaxCandidates> values{};
    Population population;
    const auto gather = [&](auto value_of) {
        std::size_t count = 0;
        for (const Blob& blob : blobs) {
            if (count == values.size()) break;
            double value = 0.0;
            if (blob.badness < kSureBadness && value_of(blob, value))
                values[count++] = static_cast<float>(value);
        }
        return std::span(values).first(count);
    };
    const auto sizes = gather([](const Blob& blob, double& value) {
        value = blob.long_axis_px;
        return true;
    });
    if (sizes.size() < std::max<std::size_t>(quorum, 1)) return population;
    population.size_px = median(sizes);
    population.size_spread = spread_about(population.size_px, sizes) / population.size_px;
    population.edge_px2 = median(gather([](const Blob& blob, double& value) {
        value = edge_square_px2(blob);
        return true;
    }));
    population.depth = median(gather([](const Blob& blob, double& value) {
        value = blob.depth;
        return true;
    }));
    const auto slopes = gather([](const Blob& blob, double& value) {
        value = blob.slope;
        return blob.slope > 0.0 && blob.short_axis_px > kLeastSlopeWidthPx;
    });
    if (slopes.size() >= quorum) {
        population.slope = median(slopes);
        population.slope_spread = spread_about(population.slope, slopes) / population.slope;
    }
    const auto depths = gather([&](const Blob& blob, double& value) {
        value = blob.depth;
        return shown_depth(blob.short_axis_px, population.edge_px2) > kWide;
    });
    if (depths.size() >= quorum) {
        population.depth = std::max(population.depth, median(depths));
        population.depth_spread = spread_about(population.depth, depths) / population.depth;
    } else {
        population.depth_spread = kUnknownDepthSpread;
    }
    return population;
}

double oddness(const Population& p, const PopulationLimits& limits, Side side, const Blob& blob) {
    if (!(p.size_px > 0.0)) return 0.0;
    const bool dark = side == Side::kBelow;
    const double ratio = std::max(blob.long_axis_px / p.size_px, p.size_px / blob.long_axis_px) - 1.0;
    const double free = std::clamp(kFreeSpreads * p.size_spread, kLeastFreeSize, kMostFreeSize);
    const double shown = shown_depth(blob.short_axis_px, p.edge_px2);
    const double depth = blob.depth / p.depth;
    const double lack = std::max(0.0, shown - depth) * (blob.completed && dark ? kPartLack : 1.0);
    double badness = kSizeSlope * ratio + std::max(0.0, ratio - free) / (limits.size_ratio - 1.0 - free);
    badness += lack / (dark ? limits.ink_spread : limits.retro_spread);
    badness += std::max(0.0, kFlattest - blob.short_axis_px / p.size_px) / kFlatSpread;
    if (dark) {
        // Ink is as dark as it is; a hole is darker.
        const double excess = depth - 1.0 - 3.0 * std::max(p.depth_spread, kLeastDepthSpread);
        badness += std::max(0.0, excess) / kExcessSpread + softness(p, blob);
    } else {
        badness += std::max(0.0, lack - kRetroLack * shown) / kRetroLackSpread;
    }
    return badness;
}

}  // namespace rig
