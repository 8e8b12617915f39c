// Charts as stand-alone SVG elements: curves, bars, values on a face. Names are escaped here; numbers that
// are not finite are left out.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace rig::host {

struct ChartPoint {
    double x = 0.0;
    double y = 0.0;
};

struct ChartSeries {
    std::string name;
    std::vector<ChartPoint> points;  // rising x
};

// A horizontal dashed line with a name: a threshold.
struct ChartLevel {
    std::string name;
    double y = 0.0;
};

// Short strokes above a chart, one at each x: when something happened.
struct ChartEvents {
    std::string name;
    std::vector<double> x;
};

struct LineChart {
    std::string x_name;
    std::string y_name;
    bool log_x = false;  // points at or under zero are left out
    bool log_y = false;
    bool from_zero = true;  // the y axis, where it is not logarithmic
    bool dots = true;       // a mark at every point
    bool ends = false;      // a mark at the last point alone
    // More than there are colours: all in one, thin, without a legend.
    std::vector<ChartSeries> series;
    std::optional<double> marked_x{};  // what was chosen: a dashed line
    std::vector<ChartLevel> levels{};  // always inside the axis
    std::vector<ChartEvents> events{};
    std::optional<std::array<double, 2>> x_range{};  // instead of the points' own
    bool gaps = false;  // a point that is not a number interrupts the curve; else it is passed over
    double width_px = 720.0;
    double height_px = 300.0;
    double left_px = 70.0;  // of the axis; several charts with the same one line up
};
[[nodiscard]] std::string line_chart(const LineChart& chart);

// Horizontal bars, one a row, with the value behind; the second value is drawn as a thin line over the bar.
struct ChartBar {
    std::string name;
    double value = 0.0;  // >= 0
    std::optional<double> second;
    bool flagged = false;
};
[[nodiscard]] std::string bar_chart(const std::vector<ChartBar>& bars, const std::string& unit);

// A histogram: upright bars over equal steps of [low, high].
struct ColumnChart {
    std::string x_name;
    std::string y_name;
    double low = 0.0;
    double high = 1.0;
    std::vector<double> values;  // >= 0
};
[[nodiscard]] std::string column_chart(const ColumnChart& chart);

// Markers as seen from the front (+x to the right, +y up), darker and larger with the value.
struct FaceDot {
    std::string name;
    double x_mm = 0.0;
    double y_mm = 0.0;
    double value = 0.0;  // >= 0
};
[[nodiscard]] std::string face_map(const std::vector<FaceDot>& dots, const std::string& unit);

// Round numbers that span [low, high], 3 to 8 of them; powers of ten where `logarithmic`.
[[nodiscard]] std::vector<double> axis_ticks(double low, double high, bool logarithmic);

}  // namespace rig::host
