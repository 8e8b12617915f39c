#include "firmware_host/companion/report/training_charts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>

namespace rig::host {

namespace {

void sort_points(ChartSeries& series) {
    std::ranges::stable_sort(series.points, {}, &ChartPoint::x);
}

// One series for each number of components that was tried with several widths.
TrainingCurve width_curve(const RbfTrainingReport& report) {
    std::map<std::size_t, ChartSeries> by_dimensions;
    for (const CrossValidation& tried : report.cross_validation) {
        ChartSeries& series = by_dimensions[tried.dimensions];
        series.name = fmt::format("{} components", tried.dimensions);
        series.points.push_back({tried.width_factor, tried.weight_rms});
    }
    TrainingCurve out{
        fmt::format("Cross-validation: weight rms on the block of the take that was left out, five blocks in "
                    "turn, against the width of the references. Chosen: {:.3g} spacings (dashed) at {} "
                    "components.",
                    report.width_factor, report.dimensions),
        LineChart{.x_name = "width, in distances between neighbouring references",
                  .y_name = "weight rms, left out",
                  .from_zero = false,
                  .series = {},
                  .marked_x = report.width_factor}};
    for (auto& [dimensions, series] : by_dimensions) {
        sort_points(series);
        // The same width may have been tried twice.
        const auto same = [](const ChartPoint& a, const ChartPoint& b) { return a.x == b.x; };
        series.points.erase(std::unique(series.points.begin(), series.points.end(), same),
                            series.points.end());
        if (series.points.size() > 1) out.chart.series.push_back(series);
    }
    return out;
}

// The best width tried at each number of components.
TrainingCurve dimension_curve(const RbfTrainingReport& report) {
    std::map<std::size_t, double> least;
    for (const CrossValidation& tried : report.cross_validation) {
        const auto [at, fresh] = least.try_emplace(tried.dimensions, tried.weight_rms);
        if (!fresh) at->second = std::min(at->second, tried.weight_rms);
    }
    TrainingCurve out{
        fmt::format("Cross-validation: the least weight rms at each number of components. Chosen: "
                    "{} (dashed).",
                    report.dimensions),
        LineChart{.x_name = "principal components",
                  .y_name = "weight rms, left out",
                  .series = {{"least", {}}},
                  .marked_x = static_cast<double>(report.dimensions)}};
    for (const auto& [dimensions, rms] : least)
        out.chart.series[0].points.push_back({static_cast<double>(dimensions), rms});
    if (least.size() < 2) out.chart.series.clear();  // the number was given
    return out;
}

// How many paths end where the one with the least lambda does: at the bound that marker noise sets.
std::size_t at_least_lambda(const std::vector<GcvPath>& paths) {
    double least = std::numeric_limits<double>::infinity();
    for (const GcvPath& path : paths) {
        if (!path.empty()) least = std::min(least, path.back().lambda);
    }
    return static_cast<std::size_t>(std::ranges::count_if(paths, [least](const GcvPath& path) {
        return !path.empty() && path.back().lambda <= least * (1.0 + 1e-6);
    }));
}

// Every shape's way from its first lambda to its last; GCV relative to the last, since shapes differ in
// scale.
TrainingCurve gcv_curve(const RbfTrainingReport& report) {
    std::size_t longest = 0;
    TrainingCurve out{{},
                      LineChart{.x_name = "lambda",
                                .y_name = "GCV over its last value",
                                .log_x = true,
                                .log_y = true,
                                .dots = false,
                                .ends = true,
                                .series = {},
                                .marked_x = report.median_lambda}};
    for (const GcvPath& path : report.gcv_paths) {
        longest = std::max(longest, path.size());
        ChartSeries series;
        for (const GcvStep& step : path) {
            if (path.back().gcv > 0.0) series.points.push_back({step.lambda, step.gcv / path.back().gcv});
        }
        if (!series.points.empty()) out.chart.series.push_back(std::move(series));
    }
    out.title = fmt::format(
        "GCV path: the ridge of every shape on its way to the minimum of generalised cross-validation, one "
        "line a "
        "shape, a dot where it ended after at most {} steps. {} of {} end at the least lambda, which the "
        "marker "
        "noise sets; a dot far to the right is a shape of which the references tell nothing. Dashed: the "
        "median, "
        "{:.2g}.",
        longest, at_least_lambda(report.gcv_paths), report.gcv_paths.size(), report.median_lambda);
    return out;
}

TrainingCurve variance_curve(const RbfTrainingReport& report) {
    TrainingCurve out{
        fmt::format("Share of the markers' variance that the first components hold; {} are kept "
                    "(dashed), {:.2f} %.",
                    report.dimensions, 100.0 * report.variance_kept),
        LineChart{.x_name = "principal components",
                  .y_name = "variance held, %",
                  .series = {{"variance", {}}},
                  .marked_x = static_cast<double>(report.dimensions)}};
    double sum = 0.0;
    for (std::size_t k = 0; k < report.variance_shares.size(); ++k) {
        sum += 100.0 * report.variance_shares[k];
        out.chart.series[0].points.push_back({static_cast<double>(k + 1), sum});
    }
    return out;
}

bool has_points(const TrainingCurve& curve) {
    return std::ranges::any_of(curve.chart.series, [](const ChartSeries& s) { return !s.points.empty(); });
}

}  // namespace

std::vector<TrainingCurve> training_curves(const RbfTrainingReport& report) {
    std::vector<TrainingCurve> out;
    for (const TrainingCurve& curve : std::array{width_curve(report), dimension_curve(report),
                                                 gcv_curve(report), variance_curve(report)}) {
        if (has_points(curve)) out.push_back(curve);
    }
    return out;
}

}  // namespace rig::host
