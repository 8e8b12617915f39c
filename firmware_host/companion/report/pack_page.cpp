#include "firmware_host/companion/report/pack_page.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "firmware_host/companion/report/page.hpp"
#include "firmware_host/companion/report/training_charts.hpp"

namespace rig::host {

namespace {

const char* solver_words(SolverKind solver) {
    switch (solver) {
        case SolverKind::kLeastSquares:
            return "least squares";
        case SolverKind::kNonNegative:
            return "non-negative least squares";
        case SolverKind::kBoxQp:
            return "box-constrained QP";
        case SolverKind::kRbf:
            return "RBF regression";
        case SolverKind::kKeyShapes:
            return "non-negative key shapes by regions";
        case SolverKind::kExamples:
            return "convex examples by regions";
    }
    return "unknown";
}

std::string optional_number(const std::optional<double>& value, int decimals) {
    return value ? fmt::format("{:.{}f}", *value, decimals) : "-";
}

void summary(const PackPageInput& input, Page& page) {
    const SolvePack& pack = input.pack;
    page.table({}, {{{"solver", solver_words(pack.solver)}, false},
                    {{"markers", std::to_string(pack.marker_count)}, false},
                    {{"shapes", std::to_string(pack.shape_count)}, false},
                    {{"cameras", std::to_string(pack.camera_count)}, false},
                    {{"rate", fmt::format("{:.4g} Hz", pack.rate_hz)}, false},
                    {{"noise of a marker coordinate", fmt::format("{:.4g} mm", pack.noise_mm)}, false},
                    {{"sparsity", fmt::format("{:.4g} mm^2", pack.sparsity_mm2)}, false},
                    {{"ridge", fmt::format("{:.4g} mm^2", pack.ridge_mm2)}, false}});
}

void invisible(const PackPageInput& input, Page& page) {
    std::string list;
    std::size_t count = 0;
    for (const ShapeFigures& shape : input.analysis.shapes) {
        if (shape.column_mm >= kInvisibleMm) continue;
        ++count;
        list += fmt::format("{}{} ({:.2f} mm)", list.empty() ? "" : ", ", shape.name, shape.column_mm);
    }
    page.heading("Rank and invisible shapes");
    page.paragraph(fmt::format("The basis has rank {} of {} shapes{}.", input.analysis.rank,
                               input.analysis.shapes.size(),
                               input.analysis.rank < input.analysis.shapes.size()
                                   ? ": the layout cannot tell all of them apart; more markers can"
                                   : ", as the box QP wants it [Hybrid16]"));
    page.paragraph(count == 0
                       ? fmt::format("Every shape moves the markers by {} mm or more in sum.", kInvisibleMm)
                       : fmt::format("{} shapes move the markers by less than {} mm in sum; their weights "
                                     "are guesses of the prior: {}",
                                     count, kInvisibleMm, list));
}

void observability(const PackPageInput& input, Page& page) {
    std::vector<ShapeFigures> shapes = input.analysis.shapes;
    std::ranges::stable_sort(shapes, {}, &ShapeFigures::confidence);
    page.heading("Observability of each shape");
    page.paragraph(
        "Column: length of the shape's motion over all markers at full weight. Spread: standard deviation of "
        "the "
        "weight before anything is seen (prior) and with every marker seen (posterior). Confidence: 1 - "
        "posterior "
        "/ prior. Bounds and the pull towards the previous frame come on top. A long column with a wide "
        "posterior is a shape that others can imitate. Least confident first.");
    std::vector<ChartBar> bars;
    std::vector<Page::Row> rows;
    const bool measured = input.analysis.take.has_value();
    for (const ShapeFigures& shape : shapes) {
        const bool flagged = shape.column_mm < kInvisibleMm;
        bars.push_back({shape.name, shape.posterior_sigma, shape.prior_sigma, flagged});
        Page::Row row{
            {shape.name, fmt::format("{:.2f}", shape.column_mm), fmt::format("{:.3f}", shape.prior_mean),
             fmt::format("{:.3f}", shape.prior_sigma), fmt::format("{:.4f}", shape.posterior_sigma),
             fmt::format("{:.3f}", shape.confidence), fmt::format("{:.4g}", shape.temporal_gamma_mm2)},
            flagged};
        if (measured) row.cells.push_back(optional_number(shape.error_rms, 4));
        rows.push_back(std::move(row));
    }
    page.figure(bar_chart(bars, ""),
                "Posterior spread (bar) against prior spread (line); (!) marks invisible shapes.");
    std::vector<std::string> columns{"shape",     "column mm",  "prior mean", "prior spread",
                                     "posterior", "confidence", "pull mm^2"};
    if (measured) columns.emplace_back("error rms");
    page.table(columns, rows);
}

void conditioning(const PackPageInput& input, Page& page) {
    page.heading("Conditioning");
    page.paragraph(
        fmt::format("Largest over smallest singular value of the basis that counts towards the rank: {:.0f}.",
                    input.analysis.condition));
    LineChart chart{.x_name = "number",
                    .y_name = "singular value, mm",
                    .log_x = false,
                    .log_y = true,
                    .dots = true,
                    .series = {{"B", {}}},
                    .marked_x = std::nullopt};
    for (std::size_t i = 0; i < input.analysis.singular_values_mm.size(); ++i)
        chart.series[0].points.push_back({static_cast<double>(i + 1), input.analysis.singular_values_mm[i]});
    page.figure(line_chart(chart), "Singular values of the marker basis B.");
}

void regions(const PackPageInput& input, Page& page) {
    const PackAnalysis& analysis = input.analysis;
    page.heading("Error by facial region");
    page.paragraph(
        "Predicted: rms over the region's markers of what noise and prior leave of the solved position of a "
        "marker. "
        "Regions are told by position alone.");
    if (input.pack.solver == SolverKind::kRbf) {
        page.paragraph(
            "The prediction is of shapes and prior, which a regression does not solve with: its own error is "
            "the "
            "measured one.");
    }
    if (analysis.take) {
        page.paragraph(
            fmt::format("Measured: {} frames of the take played on the pack's own markers with its own noise "
                        "and solved again: "
                        "marker {:.3f} mm rms, weights {:.4f} rms ({:.4f} over shapes with a column over 1 "
                        "mm). The faces are "
                        "exactly linear in the shapes, which flatters the solver.",
                        analysis.take->frames, analysis.take->marker_rms_mm, analysis.take->weight_rms,
                        analysis.take->visible_weight_rms));
    }
    std::vector<Page::Row> rows;
    for (const RegionFigures& region : analysis.regions) {
        rows.push_back({{region_name(region.region), std::to_string(region.markers),
                         fmt::format("{:.3f}", region.predicted_mm), optional_number(region.error_rms_mm, 3)},
                        false});
    }
    page.table({"region", "markers", "predicted mm", "measured mm"}, rows);
    std::vector<FaceDot> dots;
    for (const MarkerFigures& marker : analysis.markers) {
        dots.push_back({marker.name, marker.neutral_mm[0], marker.neutral_mm[1],
                        marker.error_rms_mm.value_or(marker.predicted_mm)});
    }
    page.figure(
        face_map(dots, "mm"),
        analysis.take
            ? "Measured error of each marker, rms; the face from the front, the performer's left on the "
              "right."
            : "Predicted error of each marker; the face from the front, the performer's left on the right.");
}

void coverage_table(const Coverage& coverage, Page& page) {
    page.heading("Coverage");
    page.paragraph(fmt::format(
        "How near the {} frames come to the references: {:.1f} % lie within one width of one, {:.1f} % "
        "beyond "
        "three, where the regression has nothing to go by. The frames spread {:.2f} mm (rms from their "
        "mean), "
        "which the distances in mm are to be held against.",
        coverage.frames, 100.0 * coverage.covered_share, 100.0 * coverage.lost_share, coverage.spread_mm));
    std::vector<Page::Row> rows;
    for (std::size_t q = 0; q < kCoverageQuantiles.size(); ++q) {
        rows.push_back(
            {{fmt::format("{:.0f} %", 100.0 * kCoverageQuantiles[q]),
              fmt::format("{:.2f}", coverage.widths[q]), fmt::format("{:.2f}", coverage.distance_mm[q])},
             false});
    }
    page.table({"of the frames", "within widths", "within mm"}, rows);
}

void widths_chart(const RbfModel& rbf, Page& page) {
    std::vector<double> widths(rbf.widths_mm.begin(), rbf.widths_mm.end());
    std::ranges::sort(widths);
    LineChart chart{.x_name = "reference, narrowest first",
                    .y_name = "width, mm",
                    .dots = false,
                    .series = {{"width", {}}},
                    .marked_x = std::nullopt};
    for (std::size_t k = 0; k < widths.size(); ++k)
        chart.series[0].points.push_back({static_cast<double>(k + 1), widths[k]});
    page.figure(line_chart(chart), "Widths of the references, in the space of the principal components.");
}

void regression(const PackPageInput& input, Page& page) {
    const RbfModel& rbf = input.pack.rbf;
    page.heading("Cross-validation and GCV");
    if (input.pack.solver != SolverKind::kRbf) {
        page.paragraph(
            "Nothing of this pack was chosen by cross-validation: its prior, noise, sparsity and ridge are "
            "given "
            "or measured, and every frame is solved from them. A regression (--solver rbf) has these "
            "curves.");
        return;
    }
    page.paragraph(
        fmt::format("{} references in {} principal components.", rbf.centre_count, rbf.dimension_count));
    if (input.training) {
        const RbfTrainingReport& training = input.training->rbf;
        page.paragraph(fmt::format(
            "Trained on {} frames: {:.2f} % of the variance kept, width {:.3g} x local spacing, median ridge "
            "{:.3g}. Weight rms {:.4f} in the take ({:.4f} over visible shapes), {:.4f} on blocks left out.",
            training.frames, 100.0 * training.variance_kept, training.width_factor, training.median_lambda,
            training.in_take_rms, training.visible_in_take_rms, training.cross_validated_rms));
        for (const TrainingCurve& curve : training_curves(training))
            page.figure(line_chart(curve.chart), curve.title);
    } else {
        page.paragraph(
            "The curves of the training are not in a pack. `headrig train` writes them beside it, as NAME"
            ".training.csv; with that file in the pack's folder they stand here.");
    }
    widths_chart(rbf, page);
    if (input.training)
        coverage_table(input.training->coverage, page);
    else if (input.analysis.take && input.analysis.take->coverage)
        coverage_table(*input.analysis.take->coverage, page);
}

}  // namespace

std::string pack_page(const PackPageInput& input) {
    Page page("Solve pack " + input.name);
    summary(input, page);
    invisible(input, page);
    conditioning(input, page);
    regions(input, page);
    regression(input, page);
    observability(input, page);
    return page.html();
}

}  // namespace rig::host
