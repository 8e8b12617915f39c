#include "firmware_host/companion/report/svg_chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "firmware_host/companion/report/page.hpp"
#include "firmware_host/companion/report/svg_text.hpp"

namespace rig::host {

namespace {

constexpr double kWidthPx = 720.0;
constexpr double kRightPx = 20.0;
constexpr double kTopPx = 14.0;
constexpr double kBottomPx = 48.0;
constexpr double kLegendPx = 14.0;
constexpr double kEventsPx = 12.0;
// Text, axes and grid take the page's own colour; these are told from white and from near black.
constexpr std::array kColours{"#3b82c4", "#d9773f", "#3f9e6b", "#9a6fc4", "#b8952b", "#8a8a8a"};
constexpr std::string_view kAxis = "stroke=\"currentColor\" stroke-opacity=\"0.7\"";
constexpr std::string_view kGrid = "stroke=\"currentColor\" stroke-opacity=\"0.15\"";

std::string line_between(double x0, double y0, double x1, double y1, std::string_view style) {
    return fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" {}/>\n", x0, y0, x1, y1,
                       style);
}

// One axis: values to 0..1.
struct Axis {
    double low = 0.0;
    double high = 1.0;
    bool logarithmic = false;

    [[nodiscard]] bool shows(double value) const {
        return std::isfinite(value) && (!logarithmic || value > 0.0);
    }
    [[nodiscard]] double at(double value) const {
        if (logarithmic) return std::log10(value / low) / std::log10(high / low);
        return (value - low) / (high - low);
    }
};

void widen(Axis& axis, double value) {
    if (!axis.shows(value)) return;
    axis.low = std::min(axis.low, value);
    axis.high = std::max(axis.high, value);
}

// Whole decades; never empty.
void settle(Axis& axis) {
    if (!(axis.low <= axis.high)) {
        axis.low = axis.logarithmic ? 1.0 : 0.0;
        axis.high = axis.logarithmic ? 10.0 : 1.0;
        return;
    }
    if (axis.logarithmic) {
        axis.low = std::pow(10.0, std::floor(std::log10(axis.low) + 1e-9));
        axis.high = std::pow(10.0, std::ceil(std::log10(axis.high) - 1e-9));
        if (axis.low >= axis.high) axis.high = 10.0 * axis.low;
        return;
    }
    if (axis.low >= axis.high) axis.high = axis.low + std::max(1.0, std::abs(axis.low));
}

// To the ticks below and above: the curve ends inside, and both ends of the axis have a number.
void round_out(Axis& axis) {
    if (axis.logarithmic) return;
    for (int again = 0; again < 2; ++again) {  // a wider axis may have wider steps
        const std::vector<double> ticks = axis_ticks(axis.low, axis.high, false);
        if (ticks.size() < 2) return;
        const double step = ticks[1] - ticks[0];
        axis.low = step * std::floor(axis.low / step + 1e-9);
        axis.high = step * std::ceil(axis.high / step - 1e-9);
    }
}

// Short, and without the -0 of the arithmetic; a decade that is no plain number as a power.
std::string tick_text(double tick, bool logarithmic) {
    if (logarithmic && (tick < 0.9e-3 || tick > 1.1e4)) return fmt::format("1e{:.0f}", std::log10(tick));
    if (std::abs(tick) >= 1e4 && std::abs(tick) < 1e7) return fmt::format("{:.0f}", tick);
    return fmt::format("{:.4g}", tick + 0.0);
}

Axis empty_axis(bool logarithmic) {
    return {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(), logarithmic};
}

// Where a chart's values land on the picture.
struct Frame {
    Axis x;
    Axis y;
    double left_px;
    double right_px;
    double bottom_px;
    double top_px = kTopPx;  // the legend is above
    [[nodiscard]] double x_px(double v) const { return left_px + x.at(v) * (right_px - left_px); }
    [[nodiscard]] double y_px(double v) const { return bottom_px - y.at(v) * (bottom_px - top_px); }
};

std::string draw_axes(const Frame& frame, const std::string& x_name, const std::string& y_name) {
    std::string out;
    for (const double tick : axis_ticks(frame.y.low, frame.y.high, frame.y.logarithmic)) {
        out += line_between(frame.left_px, frame.y_px(tick), frame.right_px, frame.y_px(tick), kGrid);
        out +=
            text_at(frame.left_px - 6.0, frame.y_px(tick) + 4.0, "end", tick_text(tick, frame.y.logarithmic));
    }
    const double bottom = frame.bottom_px;
    for (const double tick : axis_ticks(frame.x.low, frame.x.high, frame.x.logarithmic)) {
        out += line_between(frame.x_px(tick), bottom, frame.x_px(tick), bottom + 4.0, kAxis);
        out += text_at(frame.x_px(tick), bottom + 16.0, "middle", tick_text(tick, frame.x.logarithmic));
    }
    out += line_between(frame.left_px, bottom, frame.right_px, bottom, kAxis);
    out += line_between(frame.left_px, frame.top_px, frame.left_px, bottom, kAxis);
    out += text_at(0.5 * (frame.left_px + frame.right_px), bottom + 34.0, "middle", x_name);
    out += fmt::format(
        "<text transform=\"translate({:.1f} {:.1f}) rotate(-90)\" text-anchor=\"middle\" "
        "fill=\"currentColor\">{}</text>\n",
        frame.left_px - 56.0, 0.5 * (frame.top_px + bottom), escaped(y_name));
    return out;
}

// Names stand inside, above their line, or below it where it is the axis's end.
std::string draw_levels(const Frame& frame, const LineChart& chart) {
    std::string out;
    for (const ChartLevel& level : chart.levels) {
        const double y = frame.y_px(level.y);
        out += line_between(frame.left_px, y, frame.right_px, y,
                            fmt::format("stroke=\"{}\" stroke-dasharray=\"6 3\"", kColours[1]));
        const double text_y = y - frame.top_px < 14.0 ? y + 13.0 : y - 4.0;
        out += text_at(frame.right_px - 4.0, text_y, "end", level.name);
    }
    return out;
}

std::string draw_events(const Frame& frame, const LineChart& chart) {
    std::string out;
    for (std::size_t e = 0; e < chart.events.size(); ++e) {
        const char* const colour = kColours[(e + 3) % kColours.size()];
        std::string path;
        for (const double x : chart.events[e].x) {
            if (!std::isfinite(x) || x < frame.x.low || x > frame.x.high) continue;
            path += fmt::format("M{:.1f} {:.1f}v9", frame.x_px(x), frame.top_px - kEventsPx + 1.0);
        }
        if (!path.empty())
            out += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\"/>\n", path,
                               colour);
    }
    return out;
}

struct Pen {
    const char* colour;
    double width = 1.6;
    double opacity = 1.0;
};

std::string draw_series(const Frame& frame, const ChartSeries& series, const Pen& pen,
                        const LineChart& chart) {
    std::string path;
    std::vector<std::string> marks;
    bool joined = false;
    for (const ChartPoint& point : series.points) {
        if (!frame.x.shows(point.x) || !frame.y.shows(point.y)) {
            joined = joined && !chart.gaps;
            continue;
        }
        path += fmt::format("{}{:.1f} {:.1f}", joined ? " L" : "M", frame.x_px(point.x), frame.y_px(point.y));
        joined = true;
        marks.push_back(fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.2\" fill=\"{}\"/>\n",
                                    frame.x_px(point.x), frame.y_px(point.y), pen.colour));
    }
    if (path.empty()) return {};
    std::string out = fmt::format(
        "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-opacity=\"{}\"/>\n", path,
        pen.colour, pen.width, pen.opacity);
    for (std::size_t i = chart.ends ? marks.size() - 1 : 0; i < marks.size() && (chart.dots || chart.ends);
         ++i)
        out += marks[i];
    return out;
}

double greatest(const std::vector<ChartBar>& bars) {
    double out = 0.0;
    for (const ChartBar& bar : bars) {
        for (const double value : {bar.value, bar.second.value_or(0.0)}) {
            if (std::isfinite(value)) out = std::max(out, value);
        }
    }
    return out > 0.0 ? out : 1.0;
}

void fit_axes(const LineChart& chart, Frame& frame) {
    for (const ChartSeries& series : chart.series) {
        for (const ChartPoint& point : series.points) {
            if (!frame.x.shows(point.x) || !frame.y.shows(point.y)) continue;
            widen(frame.x, point.x);
            widen(frame.y, point.y);
        }
    }
    if (chart.marked_x) widen(frame.x, *chart.marked_x);
    if (chart.x_range) {
        frame.x.low = (*chart.x_range)[0];
        frame.x.high = (*chart.x_range)[1];
    }
    if (!chart.log_y && chart.from_zero) widen(frame.y, 0.0);
    for (const ChartLevel& level : chart.levels) widen(frame.y, level.y);
    settle(frame.x);
    settle(frame.y);
    round_out(frame.y);
}

std::string draw_legend(const LineChart& chart, bool crowd) {
    std::string out;
    double at_px = chart.left_px;
    const auto entry = [&](const std::string& name, const char* colour, double length_px) {
        out +=
            line_between(at_px, kTopPx - 2.0, at_px + length_px, kTopPx - 2.0,
                         fmt::format("stroke=\"{}\" stroke-width=\"{}\"", colour, length_px < 10.0 ? 9 : 2));
        out += text_at(at_px + length_px + 6.0, kTopPx + 2.0, "start", name);
        at_px += length_px + 22.0 + 7.0 * static_cast<double>(name.size());
    };
    for (std::size_t s = 0; s < chart.series.size() && !crowd && chart.series.size() > 1; ++s)
        entry(chart.series[s].name, kColours[s], 18.0);
    for (std::size_t e = 0; e < chart.events.size(); ++e)
        entry(chart.events[e].name, kColours[(e + 3) % kColours.size()], 2.0);
    return out;
}

// From pale blue to red, 0..1: seen on white and on near black.
std::string shade(double share) {
    const auto mix = [share](double from, double to) {
        return static_cast<int>(std::lround(from + share * (to - from)));
    };
    return fmt::format("#{:02x}{:02x}{:02x}", mix(150, 205), mix(190, 60), mix(220, 45));
}

}  // namespace

std::vector<double> axis_ticks(double low, double high, bool logarithmic) {
    std::vector<double> ticks;
    if (!std::isfinite(low) || !std::isfinite(high) || !(low < high)) return ticks;
    if (logarithmic) {
        if (!(low > 0.0)) return ticks;
        const int first = static_cast<int>(std::ceil(std::log10(low) - 1e-9));
        const int last = static_cast<int>(std::floor(std::log10(high) + 1e-9));
        const int stride = std::max(1, (last - first + 7) / 8);
        for (int decade = first; decade <= last; decade += stride) ticks.push_back(std::pow(10.0, decade));
        return ticks;
    }
    const double rough = (high - low) / 6.0;  // at most twice this is a step, so three fit
    const double decade = std::pow(10.0, std::floor(std::log10(rough)));
    double step = 10.0 * decade;
    for (const double factor : {1.0, 2.0, 2.5, 5.0}) {
        if (factor * decade >= rough * (1.0 - 1e-9)) {
            step = factor * decade;
            break;
        }
    }
    for (double i = std::ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i += 1.0)
        ticks.push_back(i * step);
    return ticks;
}

std::string line_chart(const LineChart& chart) {
    Frame frame{.x = empty_axis(chart.log_x),
                .y = empty_axis(chart.log_y),
                .left_px = chart.left_px,
                .right_px = chart.width_px - kRightPx,
                .bottom_px = chart.height_px - kBottomPx};
    fit_axes(chart, frame);
    const bool crowd = chart.series.size() > kColours.size();
    const bool legend = (chart.series.size() > 1 && !crowd) || !chart.events.empty();
    if (legend) frame.top_px += kLegendPx;
    if (!chart.events.empty()) frame.top_px += kEventsPx;
    std::string out = open_svg(chart.width_px, chart.height_px, chart.y_name + " against " + chart.x_name);
    out += draw_axes(frame, chart.x_name, chart.y_name);
    if (chart.marked_x && frame.x.shows(*chart.marked_x)) {
        out += line_between(frame.x_px(*chart.marked_x), frame.top_px, frame.x_px(*chart.marked_x),
                            frame.bottom_px,
                            "stroke=\"currentColor\" stroke-opacity=\"0.6\" stroke-dasharray=\"4 3\"");
    }
    out += draw_levels(frame, chart);
    for (std::size_t s = 0; s < chart.series.size(); ++s) {
        const Pen pen = crowd ? Pen{kColours[0], 1.0, 0.5} : Pen{kColours[s]};
        out += draw_series(frame, chart.series[s], pen, chart);
    }
    out += draw_events(frame, chart);
    if (legend) out += draw_legend(chart, crowd);
    return out + "</svg>\n";
}

std::string column_chart(const ColumnChart& chart) {
    constexpr double kColumnHeightPx = 220.0;
    constexpr double kColumnWidthPx = 410.0;
    constexpr double kColumnLeftPx = 64.0;
    Frame frame{.x = {chart.low, chart.high},
                .y = {0.0, 0.0},
                .left_px = kColumnLeftPx,
                .right_px = kColumnWidthPx - kRightPx,
                .bottom_px = kColumnHeightPx - kBottomPx};
    for (const double value : chart.values) widen(frame.y, value);
    settle(frame.x);
    settle(frame.y);
    round_out(frame.y);
    std::string out = open_svg(kColumnWidthPx, kColumnHeightPx, chart.y_name + " by " + chart.x_name);
    out += draw_axes(frame, chart.x_name, chart.y_name);
    const double step = (chart.high - chart.low) / std::max(1.0, static_cast<double>(chart.values.size()));
    for (std::size_t i = 0; i < chart.values.size(); ++i) {
        if (!std::isfinite(chart.values[i]) || chart.values[i] <= 0.0) continue;
        const double from = chart.low + step * static_cast<double>(i);
        const double left = frame.x_px(from);
        const double top = frame.y_px(chart.values[i]);
        out += fmt::format(
            "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\"><title>{:.4g} to "
            "{:.4g}: {:.6g}</title></rect>\n",
            left + 0.5, top, std::max(0.5, frame.x_px(from + step) - left - 1.0), frame.bottom_px - top,
            kColours[0], from, from + step, chart.values[i]);
    }
    return out + "</svg>\n";
}

std::string bar_chart(const std::vector<ChartBar>& bars, const std::string& unit) {
    constexpr double kRowPx = 16.0;
    constexpr double kNamePx = 190.0;
    constexpr double kValuePx = 110.0;
    const double height = kRowPx * static_cast<double>(bars.size()) + 6.0;
    const double scale = (kWidthPx - kNamePx - kValuePx) / greatest(bars);
    std::string out = open_svg(kWidthPx, height, "bars, " + unit);
    for (std::size_t i = 0; i < bars.size(); ++i) {
        const ChartBar& bar = bars[i];
        const double y = kRowPx * static_cast<double>(i) + 3.0;
        const double value = std::isfinite(bar.value) ? std::max(0.0, bar.value) : 0.0;
        double end = kNamePx + value * scale;
        out += text_at(kNamePx - 8.0, y + 11.0, "end", bar.name);
        out += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"11\" fill=\"{}\"/>\n",
                           kNamePx, y + 1.0, value * scale, bar.flagged ? kColours[1] : kColours[0]);
        if (bar.second && std::isfinite(*bar.second)) {
            const double at = kNamePx + std::max(0.0, *bar.second) * scale;
            out += line_between(at, y, at, y + 13.0, "stroke=\"currentColor\" stroke-width=\"1.5\"");
            end = std::max(end, at);
        }
        out += text_at(
            end + 6.0, y + 11.0, "start",
            fmt::format("{:.3g}{}{}{}", bar.value, unit.empty() ? "" : " ", unit, bar.flagged ? " (!)" : ""));
    }
    return out + "</svg>\n";
}

std::string face_map(const std::vector<FaceDot>& dots, const std::string& unit) {
    constexpr double kSidePx = 420.0;
    constexpr double kMarginPx = 40.0;
    Axis x = empty_axis(false);
    Axis y = empty_axis(false);
    double most = 0.0;
    for (const FaceDot& dot : dots) {
        widen(x, dot.x_mm);
        widen(y, dot.y_mm);
        if (std::isfinite(dot.value)) most = std::max(most, dot.value);
    }
    settle(x);
    settle(y);
    const double scale = (kSidePx - 2.0 * kMarginPx) / std::max(x.high - x.low, y.high - y.low);
    std::string out = open_svg(kSidePx + 160.0, kSidePx, "face from the front, " + unit);
    for (const FaceDot& dot : dots) {
        const double share =
            most > 0.0 && std::isfinite(dot.value) ? std::clamp(dot.value / most, 0.0, 1.0) : 0.0;
        const double px = 0.5 * kSidePx + (dot.x_mm - 0.5 * (x.low + x.high)) * scale;
        const double py = 0.5 * kSidePx - (dot.y_mm - 0.5 * (y.low + y.high)) * scale;
        out += fmt::format(
            "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"{}\" stroke=\"currentColor\" "
            "stroke-width=\"0.6\">"
            "<title>{}: {:.3g} {}</title></circle>\n",
            px, py, 4.0 + 6.0 * share, shade(share), escaped(dot.name), dot.value, escaped(unit));
    }
    for (int step = 0; step <= 4; ++step) {
        const double share = 0.25 * step;
        const double py = kSidePx - kMarginPx - 26.0 * step;
        out += fmt::format(
            "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"{}\" stroke=\"currentColor\" "
            "stroke-width=\"0.6\"/>\n",
            kSidePx + 30.0, py, 4.0 + 6.0 * share, shade(share));
        out += text_at(kSidePx + 48.0, py + 4.0, "start", fmt::format("{:.2g} {}", share * most, unit));
    }
    return out + "</svg>\n";
}

}  // namespace rig::host
