#include "core/solve/rbf.hpp"

#include "core/base/check.hpp"
#include "core/base/math.hpp"

namespace rig {

namespace {

constexpr double kMaxCoordinateMm = 1e6;  // a thousand faces away; keeps every square far from overflow

std::uint16_t project(const RbfModel& rbf, std::span<const float> positions_mm, RbfWorkspace& workspace) {
    const std::size_t rows = positions_mm.size();
    std::uint16_t replaced = 0;
    for (std::size_t a = 0; a < rbf.dimension_count; ++a) workspace.point_mm[a] = 0.0;
    for (std::size_t r = 0; r < rows; ++r) {
        const auto t = static_cast<double>(positions_mm[r]);
        if (!(t > -kMaxCoordinateMm && t < kMaxCoordinateMm)) {
            ++replaced;
            continue;
        }
        const double motion = t - static_cast<double>(rbf.mean_mm[r]);
        for (std::size_t a = 0; a < rbf.dimension_count; ++a) {
            workspace.point_mm[a] += static_cast<double>(rbf.basis[a * rows + r]) * motion;
        }
    }
    return replaced;
}

void measure_centres(const RbfModel& rbf, RbfWorkspace& workspace, RbfReport& report) {
    const std::size_t d = rbf.dimension_count;
    double nearest = 0.0;
    for (std::size_t k = 0; k < rbf.centre_count; ++k) {
        double squared = 0.0;
        for (std::size_t a = 0; a < d; ++a) {
            const double gap = workspace.point_mm[a] - static_cast<double>(rbf.centres[k * d + a]);
            squared += gap * gap;
        }
        const auto width = static_cast<double>(rbf.widths_mm[k]);
        const double in_widths = squared / (width * width);
        workspace.heights[k] = exp(-0.5 * in_widths);
        if (k == 0 || in_widths < nearest) {
            nearest = in_widths;
            report.nearest_centre = static_cast<std::uint16_t>(k);
        }
    }
    report.nearest_widths = sqrt(nearest);
}

}  // namespace

RbfReport evaluate_rbf(const SolvePack& pack, std::span<const float> positions_mm, RbfWorkspace& workspace,
                       std::span<double> weights) {
    const RbfModel& rbf = pack.rbf;
    const std::size_t n = pack.shape_count;
    RIG_CHECK(pack.solver == SolverKind::kRbf && rbf.centre_count > 0);
    RIG_CHECK(positions_mm.size() == 3U * pack.marker_count && weights.size() == n);
    RbfReport report;
    report.coordinates_replaced = project(rbf, positions_mm, workspace);
    measure_centres(rbf, workspace, report);
    for (std::size_t i = 0; i < n; ++i) weights[i] = static_cast<double>(rbf.offset[i]);
    for (std::size_t k = 0; k < rbf.centre_count; ++k) {
        for (std::size_t i = 0; i < n; ++i) {
            weights[i] += workspace.heights[k] * static_cast<double>(rbf.weights[k * n + i]);
        }
    }
    for (std::size_t i = 0; i < n; ++i) {
        const auto low = static_cast<double>(pack.weight_low[i]);
        const auto high = static_cast<double>(pack.weight_high[i]);
        const double inside = weights[i] < low ? low : (weights[i] > high ? high : weights[i]);
        report.weights_clamped =
            static_cast<std::uint16_t>(report.weights_clamped + (inside != weights[i] ? 1 : 0));
        weights[i] = inside;
    }
    return report;
}

}  // namespace rig
