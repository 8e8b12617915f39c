#include "firmware_host/companion/inspect/take_charts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "firmware_host/companion/files/image_file.hpp"
#include "firmware_host/companion/links/fault_text.hpp"
#include "firmware_host/companion/links/session_text.hpp"
#include "firmware_host/companion/report/data_uri.hpp"
#include "firmware_host/companion/report/page.hpp"
#include "firmware_host/companion/report/svg_text.hpp"

namespace rig::host {

namespace {

constexpr double kWidthPx = 860.0;
constexpr double kLeftPx = 130.0;
constexpr double kPlotPx = static_cast<double>(kMaxTimeBins);
constexpr double kAxisRoomPx = 44.0;
constexpr double kLegendRoomPx = 22.0;
constexpr double kRegionRoomPx = 15.0;  // for its name above its rows

// Told apart by lightness too: visible is middling, inferred light, lost dark.
struct Rgb {
    std::uint8_t r, g, b;
};
constexpr std::array<Rgb, 3> kSightingRgb{Rgb{0xb3, 0x26, 0x1e}, Rgb{0xf2, 0xb7, 0x32},
                                          Rgb{0x5a, 0xa9, 0xa0}};
constexpr std::array<const char*, 3> kSightingColours{"#b3261e", "#f2b732", "#5aa9a0"};
constexpr std::array<const char*, 5> kStateColours{"#8a8a8a", "#b3261e", "#d9773f", "#f2b732", "#5aa9a0"};
constexpr std::array<const char*, 6> kCameraColours{"none",    "#5aa9a0", "#f2b732",
                                                    "#b3261e", "#d9773f", "#9a6fc4"};
constexpr const char* kFaultColour = "#d9773f";

std::string rect(double x, double y, double width, double height, std::string_view colour) {
    return fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.2f}\" height=\"{:.1f}\" fill=\"{}\"/>\n",
                       x, y, width, height, colour);
}

std::string seconds_axis(double y, double duration_s) {
    std::string out =
        fmt::format("<path d=\"M{:.1f} {:.1f}h{:.1f}\" stroke=\"currentColor\" stroke-opacity=\"0.7\"/>\n",
                    kLeftPx, y, kPlotPx);
    for (const double tick : axis_ticks(0.0, duration_s, false)) {
        const double x = kLeftPx + kPlotPx * tick / duration_s;
        out += fmt::format("<path d=\"M{:.1f} {:.1f}v4\" stroke=\"currentColor\" stroke-opacity=\"0.7\"/>\n",
                           x, y);
        out += text_at(x, y + 16.0, "middle", fmt::format("{:.4g}", tick + 0.0));  // never -0
    }
    return out + text_at(kLeftPx + 0.5 * kPlotPx, y + 34.0, "middle", "time, s");
}

struct LegendEntry {
    std::string name;
    const char* colour;
};

std::string legend(const std::vector<LegendEntry>& entries) {
    std::string out;
    double x = kLeftPx;
    for (const LegendEntry& entry : entries) {
        out += rect(x, 3.0, 10.0, 10.0, entry.colour);
        out += text_at(x + 15.0, 12.0, "start", entry.name);
        x += 33.0 + 6.8 * static_cast<double>(entry.name.size());
    }
    return out;
}

// Bytes of UTF-8 are never torn apart.
std::string shortened(const std::string& name, std::size_t most) {
    if (name.size() <= most) return name;
    std::size_t end = most - 1;
    while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xC0U) == 0x80U) --end;
    return name.substr(0, end) + "\u2026";
}

struct TimelineRow {
    std::size_t marker;
    double y_px;
};

struct TimelineRows {
    double row_px = 10.0;
    double height_px = 0.0;
    std::vector<TimelineRow> rows;
    std::vector<std::pair<double, FaceRegion>> regions;  // where each begins
};

// By region, from the forehead down; inside a region in the layout's order.
TimelineRows timeline_rows(const TakeRecord& record) {
    TimelineRows out;
    out.row_px = record.markers.size() > 70 ? 8.0 : 10.0;
    std::vector<std::size_t> order(record.markers.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t k) { return record.markers[k].region; });
    for (const std::size_t k : order) {
        const auto region = record.markers[k].region;
        if (region && (out.regions.empty() || out.regions.back().second != *region)) {
            out.regions.emplace_back(out.height_px, *region);
            out.height_px += kRegionRoomPx;
        }
        out.rows.push_back({k, out.height_px});
        out.height_px += out.row_px;
    }
    return out;
}

// How many pixels of a column each sighting gets; what occurs at all gets one.
std::array<int, 3> column_pixels(const std::array<std::uint32_t, 3>& counts, int height) {
    const std::uint32_t total = counts[0] + counts[1] + counts[2];
    std::array<int, 3> pixels{};
    if (total == 0) return pixels;
    int left = height;
    for (std::size_t s = 0; s < 2; ++s) {
        if (counts[s] == 0) continue;
        const double share = static_cast<double>(counts[s]) / static_cast<double>(total);
        const int others = (s == 0 && counts[1] > 0 ? 1 : 0) + (counts[2] > 0 ? 1 : 0);
        pixels[s] = std::clamp(static_cast<int>(std::lround(share * height)), 1, left - others);
        left -= pixels[s];
    }
    if (counts[2] > 0) {
        pixels[2] = left;
    } else {
        pixels[counts[1] > 0 ? 1 : 0] += left;
    }
    return pixels;
}

void paint_row(const TakeRecord& record, const TimeBins& bins, const TimelineRows& rows,
               const TimelineRow& row, std::vector<std::uint8_t>& rgba) {
    std::vector<std::array<std::uint32_t, 3>> counts(bins.count);
    for (std::size_t t = 0; t < record.ticks.size(); ++t) {
        const auto sighting = static_cast<std::size_t>(record.sighting(t, row.marker));
        for (std::size_t b = bins.of_tick[t].first; b <= bins.of_tick[t].last; ++b) ++counts[b][sighting];
    }
    const int height = static_cast<int>(rows.row_px) - 1;  // a line of air between rows
    for (std::size_t b = 0; b < bins.count; ++b) {
        const std::array<int, 3> pixels = column_pixels(counts[b], height);
        int y = static_cast<int>(row.y_px);
        for (const std::size_t s : {std::size_t{2}, std::size_t{1}, std::size_t{0}}) {  // lost at the bottom
            for (int i = 0; i < pixels[s]; ++i, ++y) {
                std::uint8_t* const at = rgba.data() + 4 * (static_cast<std::size_t>(y) * bins.count + b);
                at[0] = kSightingRgb[s].r;
                at[1] = kSightingRgb[s].g;
                at[2] = kSightingRgb[s].b;
                at[3] = 255;
            }
        }
    }
}

// Runs of equal cells as rectangles; -1 is nothing.
std::string ribbon(const std::vector<int>& cells, double y, double height,
                   std::span<const char* const> colours) {
    std::string out;
    const double step = kPlotPx / static_cast<double>(cells.size());
    for (std::size_t b = 0; b < cells.size();) {
        std::size_t end = b + 1;
        while (end < cells.size() && cells[end] == cells[b]) ++end;
        if (cells[b] >= 0) {
            out += rect(kLeftPx + step * static_cast<double>(b), y, step * static_cast<double>(end - b),
                        height, colours[static_cast<std::size_t>(cells[b])]);
        }
        b = end;
    }
    return out;
}

// The cell of each column: `better` decides between two ticks of one column.
template <class Value, class Worse>
std::vector<int> cells_of(const TakeRecord& record, const TimeBins& bins, Value value, Worse worse) {
    std::vector<int> cells(bins.count, -1);
    for (std::size_t t = 0; t < record.ticks.size(); ++t) {
        const int now = value(record.ticks[t]);
        for (std::size_t b = bins.of_tick[t].first; b <= bins.of_tick[t].last; ++b) {
            if (now >= 0 && (cells[b] < 0 || worse(now, cells[b]))) cells[b] = now;
        }
    }
    return cells;
}

}  // namespace

TimeBins time_bins(const TakeRecord& record) {
    TimeBins bins;
    const double period_s = 1.0 / record.rate_hz;
    bins.duration_s = record.ticks.back().time_s + period_s;
    bins.count = std::clamp<std::size_t>(
        static_cast<std::size_t>(std::lround(bins.duration_s * record.rate_hz)), 1, kMaxTimeBins);
    const auto column = [&](double time_s) {
        const double at = time_s / bins.duration_s * static_cast<double>(bins.count);
        return std::min(bins.count - 1, static_cast<std::size_t>(std::max(0.0, at)));
    };
    constexpr double kAir = 1e-3;  // of a period: a border belongs to the tick that begins there
    for (std::size_t t = 0; t < record.ticks.size(); ++t) {
        const double from = record.ticks[t].time_s;
        double until = from + 1.5 * period_s;
        if (t + 1 < record.ticks.size()) until = std::min(until, record.ticks[t + 1].time_s);
        const std::size_t first = column(from + kAir * period_s);
        bins.of_tick.push_back({first, std::max(first, column(until - kAir * period_s))});
    }
    return bins;
}

std::string marker_timeline(const TakeRecord& record) {
    const TimeBins bins = time_bins(record);
    const TimelineRows rows = timeline_rows(record);
    const int height = static_cast<int>(rows.height_px);
    std::vector<std::uint8_t> rgba(4 * bins.count * static_cast<std::size_t>(height), 0);
    for (const TimelineRow& row : rows.rows) paint_row(record, bins, rows, row, rgba);
    std::string out = open_svg(kWidthPx, kLegendRoomPx + rows.height_px + kAxisRoomPx,
                               "visible, inferred and lost markers");
    out += legend(
        {{"visible", kSightingColours[2]}, {"inferred", kSightingColours[1]}, {"lost", kSightingColours[0]}});
    out += fmt::format(
        "<image x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{}\" preserveAspectRatio=\"none\" "
        "style=\"image-rendering:pixelated\" href=\"{}\"/>\n",
        kLeftPx, kLegendRoomPx, kPlotPx, height,
        data_uri("image/png", encode_rgba_png(static_cast<int>(bins.count), height, rgba)));
    for (const TimelineRow& row : rows.rows) {
        out += text_at(kLeftPx - 6.0, kLegendRoomPx + row.y_px + rows.row_px - 2.0, "end",
                       shortened(record.markers[row.marker].name, 14), " font-size=\"8\"");
    }
    for (const auto& [y, region] : rows.regions) {
        out += text_at(kLeftPx, kLegendRoomPx + y + kRegionRoomPx - 4.0, "start", region_name(region),
                       " font-weight=\"600\" font-size=\"9\"");
    }
    return out + seconds_axis(kLegendRoomPx + rows.height_px + 2.0, bins.duration_s) + "</svg>\n";
}

std::string state_ribbons(const TakeRecord& record) {
    constexpr double kRowPx = 18.0;
    const TimeBins bins = time_bins(record);
    const double height =
        kLegendRoomPx + kRowPx * static_cast<double>(1 + record.cameras.size()) + kAxisRoomPx;
    std::string out = open_svg(kWidthPx, height, "tracking state and cameras over time");
    std::vector<LegendEntry> entries;
    for (int s = 4; s >= 0; --s)
        entries.push_back({std::string(state_word(static_cast<TrackingState>(s))),
                           kStateColours[static_cast<std::size_t>(s)]});
    if (!record.cameras.empty()) {
        entries.push_back({"camera " + std::string(camera_word(CameraStatus::kGood)), kCameraColours[1]});
        for (const CameraStatus status :
             {CameraStatus::kMissing, CameraStatus::kGone, CameraStatus::kFrozen, CameraStatus::kExposure})
            entries.push_back(
                {std::string(camera_word(status)), kCameraColours[static_cast<std::size_t>(status)]});
    }
    out += legend(entries);
    const auto states = cells_of(
        record, bins, [](const TakeTick& tick) { return static_cast<int>(tick.state); },
        [](int a, int b) { return a < b; });
    out += text_at(kLeftPx - 6.0, kLegendRoomPx + 12.0, "end", "state");
    out += ribbon(states, kLegendRoomPx, kRowPx - 3.0, kStateColours);
    double y = kLegendRoomPx + kRowPx;
    for (std::size_t c = 0; c < record.cameras.size() && c < kMaxCameras; ++c, y += kRowPx) {
        const auto cells = cells_of(
            record, bins,
            [c](const TakeTick& tick) {
                return tick.cameras[c] == CameraStatus::kUnused ? -1 : static_cast<int>(tick.cameras[c]);
            },
            [](int a, int b) { return a != 1 && (b == 1 || a > b); });
        out += text_at(kLeftPx - 6.0, y + 12.0, "end", shortened("camera " + record.cameras[c], 18));
        out += ribbon(cells, y, kRowPx - 3.0, kCameraColours);
    }
    return out + seconds_axis(y, bins.duration_s) + "</svg>\n";
}

std::string fault_ribbons(const TakeRecord& record, const std::vector<FaultSummary>& faults) {
    constexpr double kRowPx = 32.0;
    const TimeBins bins = time_bins(record);
    std::string out =
        open_svg(kWidthPx, kRowPx * static_cast<double>(faults.size()) + kAxisRoomPx, "faults over time");
    double y = 0.0;
    constexpr std::array<const char*, 1> kOneColour{kFaultColour};
    for (const FaultSummary& fault : faults) {
        const auto cells = cells_of(
            record, bins,
            [&](const TakeTick& tick) { return ((tick.faults >> (fault.number - 1)) & 1U) != 0 ? 0 : -1; },
            [](int, int) { return false; });
        out += text_at(kLeftPx - 6.0, y + 25.0, "end", fault_code(fault.number), " font-weight=\"600\"");
        out += text_at(kLeftPx, y + 12.0, "start", fault_text(fault.number));
        out += fmt::format(
            "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"11\" fill=\"currentColor\" "
            "fill-opacity=\"0.08\"/>\n",
            kLeftPx, y + 16.0, kPlotPx);
        out += ribbon(cells, y + 16.0, 11.0, kOneColour);
        y += kRowPx;
    }
    return out + seconds_axis(y, bins.duration_s) + "</svg>\n";
}

std::string tick_curve(const TakeRecord& record, const std::string& y_name,
                       const std::function<double(const TakeTick&)>& value,
                       const std::vector<ChartLevel>& levels) {
    LineChart chart{
        .x_name = "time, s", .y_name = y_name, .dots = false, .series = {{y_name, {}}}, .levels = levels};
    chart.gaps = true;
    chart.width_px = kWidthPx;
    chart.height_px = 200.0;
    chart.left_px = kLeftPx;
    const TimeBins bins = time_bins(record);
    chart.x_range = {0.0, bins.duration_s};
    std::vector<ChartPoint>& points = chart.series[0].points;
    for (std::size_t t = 0; t < record.ticks.size();) {
        const std::size_t bin = bins.of_tick[t].first;
        const TakeTick* least = nullptr;
        const TakeTick* most = nullptr;
        if (t > 0 && bin > bins.of_tick[t - 1].last + 1)
            points.push_back({record.ticks[t].time_s, std::numeric_limits<double>::quiet_NaN()});
        const TakeTick& first = record.ticks[t];
        for (; t < record.ticks.size() && bins.of_tick[t].first == bin; ++t) {
            const TakeTick& tick = record.ticks[t];
            if (!std::isfinite(value(tick))) continue;
            if (least == nullptr || value(tick) < value(*least)) least = &tick;
            if (most == nullptr || value(tick) > value(*most)) most = &tick;
        }
        if (least == nullptr) {
            points.push_back({first.time_s, std::numeric_limits<double>::quiet_NaN()});
            continue;
        }
        if (most < least) std::swap(least, most);
        points.push_back({least->time_s, value(*least)});
        if (most != least) points.push_back({most->time_s, value(*most)});
    }
    ChartEvents swaps{"names repaired or refused", {}};
    ChartEvents anew{"identities found anew, or reset", {}};
    for (const TakeTick& tick : record.ticks) {
        if (tick.swaps_repaired + tick.names_rejected > 0) swaps.x.push_back(tick.time_s);
        if (tick.bootstrapped || tick.reset) anew.x.push_back(tick.time_s);
    }
    for (ChartEvents* events : {&swaps, &anew}) {
        if (!events->x.empty()) chart.events.push_back(std::move(*events));
    }
    return line_chart(chart);
}

}  // namespace rig::host
