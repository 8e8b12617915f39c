#include "firmware_host/companion/inspect/inspect_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "firmware_host/companion/inspect/take_charts.hpp"
#include "firmware_host/companion/inspect/take_figures.hpp"
#include "firmware_host/companion/links/fault_text.hpp"
#include "firmware_host/companion/report/page.hpp"

namespace rig::host {

namespace {

constexpr std::size_t kWorstMarkers = 12;

std::string percent(double share) {
    return fmt::format("{:.2f}", 100.0 * share);
}

void summary(const TakeRecord& record, const InspectFigures& figures, Page& page) {
    std::string line = record.source;
    for (const std::string& fact : summary_facts(record, figures)) line += "; " + fact;
    page.paragraph(line + ".");
    for (const std::string& remark : record.remarks) page.paragraph(remark);
    if (!record.cut.empty()) page.paragraph("The file ends early: " + record.cut + ".");
}

void timeline(const TakeRecord& record, Page& page) {
    page.heading("Markers over time");
    if (record.sightings.empty()) {
        page.paragraph("Nothing is known of the markers of this take.");
        return;
    }
    page.figure(marker_timeline(record),
                "Visible: seen in this frame. Inferred: hidden, its place follows from the others. Lost: no "
                "face in this "
                "frame, or nothing tells the place. A column that stands for several frames is divided by "
                "how many had "
                "which. Regions are told by a marker's place at rest.");
}

void states(const TakeRecord& record, const InspectFigures& figures, Page& page) {
    page.heading("Tracking state");
    page.figure(state_ribbons(record),
                "LIVE: tracked. PARTIAL: parts are not seen well. HOLD: no face just now, the last good one "
                "is held. LOST: for "
                "longer. SAFE: the rig has no pack. A column shows the worst of its frames.");
    page.heading("Faults");
    if (figures.faults.empty()) {
        page.paragraph("None was raised.");
        return;
    }
    page.figure(fault_ribbons(record, figures.faults), "When each fault was up.");
    std::vector<Page::Row> rows;
    for (const FaultSummary& fault : figures.faults) {
        const double share = static_cast<double>(fault.ticks) / static_cast<double>(figures.ticks);
        rows.push_back({{fault_code(fault.number), std::to_string(fault.ticks), percent(share),
                         std::to_string(fault.times), fmt::format("{:.2f}", fault.first_s)},
                        false});
    }
    page.table({"fault", "frames", "of all %", "times raised", "first at s"}, rows);
}

void camera_drift(const TakeRecord& record, Page& page) {
    const auto shift = [](const TakeTick& tick) { return tick.camera_shift_px; };
    const bool known =
        std::ranges::any_of(record.ticks, [&](const TakeTick& t) { return std::isfinite(shift(t)); });
    if (!known) return;
    const double limit_px = MountDriftConfig{}.raise_px;
    page.heading("Cameras on the helmet");
    page.figure(
        tick_curve(record, "shift, px", shift, {{fmt::format("alarm {:.1f} px", limit_px), limit_px}}),
        "How far the picture of the worst camera has moved since calibration, by the helmet's reference "
        "marks.");
}

void curves(const TakeRecord& record, const InspectFigures& figures, Page& page) {
    if (figures.residual_max_mm) {
        page.heading("Residual");
        page.figure(
            tick_curve(record, "residual rms, mm", [](const TakeTick& tick) { return tick.residual_rms_mm; },
                       {}),
            "What the solved face leaves unexplained of the markers that were seen, over their coordinates. "
            "Strokes on top: names that were repaired or refused, and identities that were found anew.");
    }
    if (!figures.slip_max_deg) return;
    page.heading("Slip of the helmet");
    page.figure(tick_curve(record, "rotation, deg", [](const TakeTick& tick) { return tick.slip_deg; },
                           {{fmt::format("alarm {:.1f} deg", kSlipAlarmDeg), kSlipAlarmDeg}}),
                "Angle between the helmet as calibrated and as worn.");
    page.figure(tick_curve(record, "translation, mm", [](const TakeTick& tick) { return tick.slip_mm; },
                           {{fmt::format("alarm {:.1f} mm", kSlipAlarmMm), kSlipAlarmMm}}),
                fmt::format("How far the face's origin, between the eyes, has moved in the helmet. {} frames "
                            "lie beyond an alarm, which raises "
                            "F20: re-seat the rig.",
                            figures.slip_alarm_ticks));
}

std::string histogram(const Histogram& of, const std::string& x_name, const std::string& y_name) {
    ColumnChart chart{.x_name = x_name, .y_name = y_name, .low = of.low, .high = of.high, .values = {}};
    for (const std::uint64_t count : of.counts) chart.values.push_back(static_cast<double>(count));
    return column_chart(chart);
}

void histograms(const TakeRecord& record, Page& page) {
    std::vector<std::string> charts;
    if (record.residual_mm.total() > 0)
        charts.push_back(histogram(record.residual_mm, "residual of a marker, mm", "markers x frames"));
    if (record.diameter_px.total() > 0) {
        charts.push_back(histogram(record.diameter_px, "diameter of a blob, px", "blobs"));
        charts.push_back(histogram(record.contrast, "contrast of a blob, 1 = full scale", "blobs"));
    }
    if (charts.empty()) return;
    page.heading("Distributions");
    page.figures(
        charts,
        "Residual of a marker: distance of its stabilised place from the solved face, neutral + B w. What "
        "lies beyond the axis is counted in its last column.");
}

Page::Row marker_row(const TakeRecord& record, const MarkerSummary& marker) {
    const InspectedMarker& about = record.markers[marker.marker];
    Page::Row row{
        {about.name, about.region ? region_name(*about.region) : "-", percent(marker.visible),
         percent(marker.inferred), percent(marker.lost),
         fmt::format("{:.0f}", 1e3 * marker.longest_hidden_s.value),
         marker.longest_hidden_s.value > 0.0 ? fmt::format("{:.2f}", marker.longest_hidden_s.at_s) : "-"},
        false};
    if (record.residuals_mm.empty()) return row;
    row.cells.push_back(marker.residual_max_mm ? fmt::format("{:.3f}", marker.residual_rms_mm) : "-");
    row.cells.push_back(marker.residual_max_mm ? fmt::format("{:.3f}", marker.residual_max_mm->value) : "-");
    row.cells.push_back(marker.residual_max_mm ? fmt::format("{:.2f}", marker.residual_max_mm->at_s) : "-");
    return row;
}

void worst_markers(const TakeRecord& record, const InspectFigures& figures, Page& page) {
    if (figures.markers.empty()) return;
    std::vector<std::string> columns{"marker", "region",    "visible %", "inferred %",
                                     "lost %", "hidden ms", "from s"};
    if (!record.residuals_mm.empty()) {
        columns.insert(columns.end(), {"rms mm", "most mm", "at s"});
    }
    std::vector<MarkerSummary> order = figures.markers;
    const auto table = [&](std::size_t most) {
        std::vector<Page::Row> rows;
        for (std::size_t i = 0; i < std::min(most, order.size()); ++i)
            rows.push_back(marker_row(record, order[i]));
        page.table(columns, rows);
    };
    page.heading("Markers hidden longest");
    page.paragraph(
        "Hidden: the longest time in a row without being seen, and when it began. Residuals: over the frames "
        "that saw the marker.");
    std::ranges::stable_sort(order, std::ranges::greater{},
                             [](const MarkerSummary& m) { return m.longest_hidden_s.value; });
    table(kWorstMarkers);
    if (record.residuals_mm.empty()) return;
    page.heading("Markers with the largest residual");
    std::ranges::stable_sort(order, std::ranges::greater{}, &MarkerSummary::residual_rms_mm);
    table(kWorstMarkers);
    std::vector<FaceDot> dots;
    for (const MarkerSummary& marker : figures.markers) {
        const InspectedMarker& about = record.markers[marker.marker];
        dots.push_back({about.name, about.neutral_mm[0], about.neutral_mm[1], marker.residual_rms_mm});
    }
    page.figure(
        face_map(dots, "mm"),
        "Residual of each marker, rms over the take; the face from the front, the performer's left on the "
        "right. One marker that stands out may have moved on the skin.");
}

void moments(const TakeRecord& record, Page& page) {
    if (record.moments.empty()) return;
    page.heading("Moments to look at");
    page.paragraph(
        "Green ring with name: a blob and the marker that it was taken for. Pink square: a blob that no "
        "marker took, "
        "a ghost or a mark of the helmet. Orange diamond: where a hidden marker must be. Blue cross: a "
        "marker that "
        "only another camera sees.");
    for (const Moment& moment : record.moments) {
        std::string reasons;
        for (const std::string& reason : moment.reasons) reasons += (reasons.empty() ? "" : "; ") + reason;
        std::vector<std::string> pictures;
        for (const SceneView& view : moment.views) pictures.push_back(scene_svg(view, record.markers));
        page.figures(pictures, fmt::format("{:.2f} s, frame {}: {}.", moment.time_s, moment.tick, reasons));
    }
}

}  // namespace

std::string inspect_page(const TakeRecord& record) {
    Page page("Take " + record.name);
    const InspectFigures figures = figures_of(record);
    summary(record, figures, page);
    if (record.ticks.empty()) {
        page.paragraph("The take holds no frame; there is nothing to draw.");
        return page.html();
    }
    timeline(record, page);
    states(record, figures, page);
    curves(record, figures, page);
    camera_drift(record, page);
    histograms(record, page);
    worst_markers(record, figures, page);
    moments(record, page);
    return page.html();
}

}  // namespace rig::host
