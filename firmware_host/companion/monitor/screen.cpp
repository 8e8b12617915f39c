#include "firmware_host/companion/monitor/screen.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "firmware_host/companion/links/fault_text.hpp"
#include "firmware_host/companion/links/session_text.hpp"

namespace rig::host {

namespace {

constexpr std::size_t kLongestName = 24;
constexpr std::size_t kValueWidth = 6;  // "-0.250"
constexpr std::size_t kNarrowestBar = 8;
constexpr std::size_t kWidestBar = 40;
constexpr std::size_t kMostFaultLines = 4;
constexpr float kLowConfidence = 0.5F;

constexpr std::string_view kPlain = "\x1b[0m";
constexpr std::string_view kBold = "\x1b[1m";
constexpr std::string_view kDim = "\x1b[2m";
constexpr std::string_view kRed = "\x1b[31m";
constexpr std::string_view kGreen = "\x1b[32m";
constexpr std::string_view kYellow = "\x1b[33m";

std::string painted(std::string_view text, std::string_view sequence, bool colour) {
    return colour ? fmt::format("{}{}{}", sequence, text, kPlain) : std::string(text);
}

std::string_view state_colour(TrackingState state) {
    switch (state) {
        case TrackingState::kLive:
            return kGreen;
        case TrackingState::kPartial:
        case TrackingState::kHold:
            return kYellow;
        case TrackingState::kLost:
        case TrackingState::kSafe:
            break;
    }
    return kRed;
}

std::string phase_text(const MonitorModel& model) {
    switch (model.phase) {
        case SessionPhase::kClosed:
            return "the link is lost; waiting for it to come back";
        case SessionPhase::kGreeting:
            return model.hello ? "the rig has gone silent; asking again" : "asking who is there";
        case SessionPhase::kClaiming:
        case SessionPhase::kNaming:
        case SessionPhase::kStarting:
            return "greeting the rig";
        case SessionPhase::kRefused:
            return "refused: " + model.refusal;
        case SessionPhase::kReady:
            break;
    }
    return {};
}

std::string latency_text(const MonitorModel& model) {
    return model.latency_us ? fmt::format("{:.1f} ms", static_cast<double>(*model.latency_us) / 1000.0) : "-";
}

std::string title_line(const MonitorModel& model, std::size_t columns, bool colour) {
    std::string text = "headrig monitor  " + model.link;
    if (model.hello) {
        text += fmt::format("  {} ({}), firmware {}", model.hello->serial.view(), model.hello->board.view(),
                            model.hello->firmware.view());
    }
    return painted(fitted(text, columns), kBold, colour);
}

std::string state_line(const MonitorModel& model, std::size_t columns, bool colour) {
    const std::string waiting = phase_text(model);
    if (!waiting.empty()) return painted(fitted(waiting, columns), kYellow, colour);
    if (!model.state) return fitted("waiting for the first state", columns);
    const std::string_view word = state_word(model.state->state);
    const std::string rest =
        fmt::format("{}  {:.1f} Hz  latency {}  missing {}  lost {}  damaged {}",
                    model.state->held ? " held" : "", model.rate_hz, latency_text(model),
                    model.counters.states_missing, model.counters.frames_lost, model.bad_frames);
    if (columns <= word.size()) return fitted(word, columns);
    return painted(word, state_colour(model.state->state), colour) + fitted(rest, columns - word.size());
}

std::string camera_line(const MonitorModel& model) {
    std::string text;
    for (std::size_t c = 0; c < kMaxCameras; ++c) {
        const CameraStatus status = model.state->cameras[c];
        if (status == CameraStatus::kUnused) continue;
        text += fmt::format("camera {} {}", c, camera_word(status));
        if (model.health) text += fmt::format(" ({} spots)", model.health->observations[c]);
        text += "  ";
    }
    if (model.health) {
        text += fmt::format("markers {}  solve p99 {:.1f} ms  overruns {}  replaced {}",
                            model.health->markers_seen, model.health->solve.p99_us / 1000.0,
                            model.health->overruns, model.health->frames_dropped);
    }
    return text;
}

// Where the head is, or why nobody knows; empty for cameras that are on it.
std::string head_line(const MonitorModel& model) {
    const bool told = model.hello && (model.hello->capabilities & kCanStreamHead) != 0;
    if (!told) return {};
    const HeadPlace& head = model.state->head;
    if (head.status != HeadStatus::kKnown) return fmt::format("head pose: {}", head_word(head.status));
    constexpr float kDegrees = 57.29578F;
    return fmt::format(
        "head pose: turn {:.1f} {:.1f} {:.1f} degrees  place {:.1f} {:.1f} {:.1f} mm  rms {:.2f} px",
        head.rotation_rad[0] * kDegrees, head.rotation_rad[1] * kDegrees, head.rotation_rad[2] * kDegrees,
        head.translation_mm[0], head.translation_mm[1], head.translation_mm[2], head.rms_px);
}

void add_faults(const MonitorModel& model, std::size_t columns, bool colour,
                std::vector<std::string>& lines) {
    const std::vector<int> faults = faults_of(model.state->faults);
    for (std::size_t i = 0; i < faults.size(); ++i) {
        if (i + 1 == kMostFaultLines && faults.size() > kMostFaultLines) {
            const std::string more = fmt::format("and {} more; see `headrig status`", faults.size() - i);
            lines.push_back(painted(fitted(more, columns), kRed, colour));
            return;
        }
        const std::string text = fmt::format("{} {}", fault_code(faults[i]), fault_text(faults[i]));
        lines.push_back(painted(fitted(text, columns), kRed, colour));
    }
}

// A bar of 0..1; '<' and '>' at its ends say that the weight lies beyond.
std::string bar(float weight, std::size_t width) {
    const auto filled =
        static_cast<std::size_t>(std::lround(std::clamp(weight, 0.0F, 1.0F) * static_cast<float>(width)));
    std::string text(width, '.');
    std::fill_n(text.begin(), filled, '#');
    if (weight < -0.005F) text.front() = '<';
    if (weight > 1.005F) text.back() = '>';
    return text;
}

struct Grid {
    std::size_t columns = 1;
    std::size_t rows = 1;
    std::size_t name_width = 1;
    std::size_t bar_width = kNarrowestBar;
};

// As few columns as show every shape, bars as wide as then fit.
Grid grid_of(const MonitorModel& model, std::size_t shapes, ScreenSize room) {
    Grid grid;
    for (const std::string& name : model.shape_names)
        grid.name_width = std::max(grid.name_width, text_width(name));
    grid.name_width = std::min(grid.name_width, kLongestName);
    const std::size_t narrowest = grid.name_width + 1 + kNarrowestBar + 1 + kValueWidth + 2;
    const std::size_t most_columns = std::max<std::size_t>(1, (room.columns + 2) / narrowest);
    const std::size_t wanted = (shapes + room.rows - 1) / std::max<std::size_t>(1, room.rows);
    grid.columns = std::clamp<std::size_t>(wanted, 1, most_columns);
    grid.rows = std::min(room.rows, (shapes + grid.columns - 1) / grid.columns);
    const std::size_t cell = (room.columns + 2) / grid.columns;
    const std::size_t taken = grid.name_width + 1 + 1 + kValueWidth + 2;
    grid.bar_width = std::clamp(cell > taken ? cell - taken : 1, std::size_t{1}, kWidestBar);
    return grid;
}

std::string cell(const MonitorModel& model, std::size_t shape, const Grid& grid, bool colour) {
    const std::string number = fmt::format("#{}", shape);
    const std::string_view name = shape < model.shape_names.size() ? model.shape_names[shape] : number;
    const std::string text = fmt::format("{} {} {:>{}.3f}", fitted(name, grid.name_width),
                                         bar(model.state->weights[shape], grid.bar_width),
                                         model.state->weights[shape], kValueWidth);
    return model.state->confidence[shape] < kLowConfidence ? painted(text, kDim, colour) : text;
}

void add_bars(const MonitorModel& model, ScreenSize room, bool colour, std::vector<std::string>& lines) {
    const std::size_t shapes = model.state->shape_count;
    const Grid grid = grid_of(model, shapes, room);
    // Too narrow for a bar: a cut line would be no use.
    if (grid.name_width + 1 + grid.bar_width + 1 + kValueWidth > room.columns) return;
    for (std::size_t row = 0; row < grid.rows; ++row) {
        std::string line;
        for (std::size_t column = 0; column < grid.columns; ++column) {
            const std::size_t shape = column * grid.rows + row;
            if (shape >= shapes) break;
            if (column > 0) line += "  ";
            line += cell(model, shape, grid, colour);
        }
        lines.push_back(line);
    }
}

}  // namespace

std::size_t text_width(std::string_view utf8) {
    return static_cast<std::size_t>(std::count_if(
        utf8.begin(), utf8.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

std::string fitted(std::string_view utf8, std::size_t width) {
    const std::size_t own = text_width(utf8);
    if (own <= width) return std::string(utf8) + std::string(width - own, ' ');
    std::size_t end = 0;
    for (std::size_t taken = 0; end < utf8.size(); ++end) {
        if ((static_cast<unsigned char>(utf8[end]) & 0xC0U) != 0x80U && taken++ == width) break;
    }
    return std::string(utf8.substr(0, end));
}

std::vector<std::string> monitor_screen(const MonitorModel& model, ScreenSize size, bool colour) {
    std::vector<std::string> lines;
    lines.push_back(title_line(model, size.columns, colour));
    lines.push_back(state_line(model, size.columns, colour));
    if (model.state) {
        lines.push_back(fitted(camera_line(model), size.columns));
        if (const std::string head = head_line(model); !head.empty())
            lines.push_back(fitted(head, size.columns));
        add_faults(model, size.columns, colour, lines);
        if (!model.last_event.empty()) lines.push_back(fitted("last: " + model.last_event, size.columns));
        lines.emplace_back();
        // One row stays free for the key help.
        if (lines.size() + 1 < size.rows)
            add_bars(model, {size.columns, size.rows - lines.size() - 1}, colour, lines);
    }
    while (lines.size() + 1 < size.rows) lines.emplace_back();
    if (lines.size() < size.rows) lines.push_back(fitted("Ctrl-C ends", size.columns));
    lines.resize(std::min(lines.size(), size.rows));
    return lines;
}

std::string monitor_line(const MonitorModel& model, double elapsed_s) {
    const std::string waiting = phase_text(model);
    if (!waiting.empty()) return fmt::format("{:.1f} s: {}", elapsed_s, waiting);
    if (!model.state) return fmt::format("{:.1f} s: waiting for the first state", elapsed_s);
    const FaceState& state = *model.state;
    std::string faults;
    for (const int number : faults_of(state.faults))
        faults += (faults.empty() ? "" : "+") + fault_code(number);
    std::string strongest = "-";
    const auto first = state.weights.begin();
    const auto peak = std::max_element(first, first + state.shape_count);
    if (const auto index = static_cast<std::size_t>(peak - first); index < model.shape_names.size()) {
        strongest = fmt::format("{}={:.3f}", model.shape_names[index], *peak);
    }
    const std::string head = head_line(model);
    return fmt::format(
        "{:.1f} s: {}{} rate {:.1f} Hz latency {} missing {} lost {} damaged {} faults {} strongest {}{}{}",
        elapsed_s, state_word(state.state), state.held ? " held" : "", model.rate_hz, latency_text(model),
        model.counters.states_missing, model.counters.frames_lost, model.bad_frames,
        faults.empty() ? "none" : faults, strongest, head.empty() ? "" : " ", head);
}

}  // namespace rig::host
