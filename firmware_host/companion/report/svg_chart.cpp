#include "firmware_host/companion/report/svg_chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "firmware_host/companion/report/page.hpp"

namespace rig::host {

namespace {

constexpr double kWidthPx = 720.0;
constexpr double kHeightPx = 300.0;
constexpr double kLeftPx = 70.0;
constexpr double kRightPx = 20.0;
constexpr double kTopPx = 14.0;
constexpr double kBottomPx = 48.0;
constexpr double kLegendPx = 14.0;
// Text, axes and grid take the page's own colour; these are told from white and from near black.
constexpr std::array kColours{"#3b82c4", "#d9773f", "#3f9e6b", "#9a6fc4", "#b8952b", "#8a8a8a"};
constexpr std::string_view kAxis = "stroke=\"currentColor\" stroke-opacity=\"0.7\"";
constexpr std::string_view kGrid = "stroke=\"currentColor\" stroke-opacity=\"0.15\"";

std::string open_svg(double width, double height, std::string_view label) {
    return fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.0f} {:.0f}\" width=\"{:.0f}\" "
        "height=\"{:.0f}\" role=\"img\" aria-label=\"{}\" font-family=\"DejaVu Sans, sans-serif\" "
        "font-size=\"11\">\n",
        width, height, width, height, escaped(label));
}

std::string text_at(double x, double y, std::string_view anchor, std::string_view text) {
    return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" fill=\"currentColor\">{}</text>\n",
                       x, y, anchor, escaped(text));
}

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
    return fmt::format("{:.4g}", tick + 0.0);
}

Axis empty_axis(bool logarithmic) {
    return {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(), logarithmic};
}

// Where a chart's values land on the picture.
struct Frame {
    Axis x;
    Axis y;
    double top_px = kTopPx;  // the legend is above
    [[nodiscard]] double x_px(double v) const { return kLeftPx + x.at(v) * (kWidthPx - kLeftPx - kRightPx); }
    [[nodiscard]] double y_px(double v) const {
        return kHeightPx - kBottomPx - y.at(v) * (kHeightPx - top_px - kBottomPx);
    }
};

std::string draw_axes(const Frame& frame, const LineChart& chart) {
    std::string out;
    const double bottom = kHeightPx - kBottomPx;
    for (const double tick : axis_ticks(frame.y.low, frame.y.high, frame.y.logarithmic)) {
        out += line_between(kLeftPx, frame.y_px(tick), kWidthPx - kRightPx, frame.y_px(tick), kGrid);
        out += text_at(kLeftPx - 6.0, frame.y_px(tick) + 4.0, "end", tick_text(tick, frame.y.logarithmic));
    }
    for (const double tick : axis_ticks(frame.x.low, frame.x.high, frame.x.logarithmic)) {
        out += line_between(frame.x_px(tick), bottom, frame.x_px(tick), bottom + 4.0, kAxis);
        out += text_at(frame.x_px(tick), bottom + 16.0, "middle", tick_text(tick, frame.x.logarithmic));
    }
    out += line_between(kLeftPx, bottom, kWidthPx - kRightPx, bottom, kAxis);
    out += line_between(kLeftPx, frame.top_px, kLeftPx, bottom, kAxis);
    out += text_at(0.5 * (kLeftPx + kWidthPx - kRightPx), kHeightPx - 14.0, "middle", chart.x_name);
    out += fmt::format(
        "<text transform=\"translate(14 {:.1f}) rotate(-90)\" text-anchor=\"middle\" "
        "fill=\"currentColor\">{}</text>\n",
        0.5 * (frame.top_px + bottom), escaped(chart.y_name));
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
    for (const ChartPoint& point : series.points) {
        if (!frame.x.shows(point.x) || !frame.y.shows(point.y)) continue;
        path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : " L", frame.x_px(point.x),
                            frame.y_px(point.y));
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
    Frame frame{empty_axis(chart.log_x), empty_axis(chart.log_y)};
    for (const ChartSeries& series : chart.series) {
        for (const ChartPoint& point : series.points) {
            if (!frame.x.shows(point.x) || !frame.y.shows(point.y)) continue;
            widen(frame.x, point.x);
            widen(frame.y, point.y);
        }
    }
    if (chart.marked_x) widen(frame.x, *chart.marked_x);
    if (!chart.log_y && chart.from_zero) widen(frame.y, 0.0);
    settle(frame.x);
    settle(frame.y);
    round_out(frame.y);
    const bool crowd = chart.series.size() > kColours.size();
    const bool legend = chart.series.size() > 1 && !crowd;
    if (legend) frame.top_px += kLegendPx;
    std::string out = open_svg(kWidthPx, kHeightPx, chart.y_name + " against " + chart.x_name);
    out += draw_axes(frame, chart);
    if (chart.marked_x && frame.x.shows(*chart.marked_x)) {
        out += line_between(frame.x_px(*chart.marked_x), frame.top_px, frame.x_px(*chart.marked_x),
                            kHeightPx - kBottomPx,
                            "stroke=\"currentColor\" stroke-opacity=\"0.6\" stroke-dasharray=\"4 3\"");
    }
    double legend_px = kLeftPx;
    for (std::size_t s = 0; s < chart.series.size(); ++s) {
        const Pen pen = crowd ? Pen{kColours[0], 1.0, 0.5} : Pen{kColours[s]};
        out += draw_series(frame, chart.series[s], pen, chart);
        if (!legend) continue;
        out += line_between(legend_px, kTopPx - 2.0, legend_px + 18.0, kTopPx - 2.0,
                            fmt::format("stroke=\"{}\" stroke-width=\"2\"", pen.colour));
        out += text_at(legend_px + 24.0, kTopPx + 2.0, "start", chart.series[s].name);
        legend_px += 40.0 + 7.0 * static_cast<double>(chart.series[s].name.size());
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
