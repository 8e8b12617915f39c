// What the monitor shows, as lines of text. Pure: the same model and size give the same lines. Not for:
// terminals (terminal.hpp), links.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/face_state.hpp"
#include "core/wire/health.hpp"
#include "core/wire/session_messages.hpp"
#include "firmware_host/companion/links/host_session.hpp"

namespace rig::host {

struct MonitorModel {
    std::string link;
    SessionPhase phase = SessionPhase::kGreeting;
    std::string refusal;
    std::optional<Hello> hello;
    std::vector<std::string> shape_names;
    std::optional<FaceState> state;
    std::optional<Health> health;
    std::optional<std::int64_t> latency_us;
    double rate_hz = 0.0;  // of states received
    SessionCounters counters;
    std::uint64_t bad_frames = 0;
    std::string last_event;
};

struct ScreenSize {
    std::size_t columns = 80;
    std::size_t rows = 24;
};

// At most size.rows lines of at most size.columns characters. With `colour`, SGR sequences stand between them
// that take no room; they never span lines.
[[nodiscard]] std::vector<std::string> monitor_screen(const MonitorModel& model, ScreenSize size,
                                                      bool colour);

// The same in one line, for pipes and logs.
[[nodiscard]] std::string monitor_line(const MonitorModel& model, double elapsed_s);

// Characters that a text takes on the screen, as far as one code point is one cell.
[[nodiscard]] std::size_t text_width(std::string_view utf8);
// Cut or padded with blanks to exactly `width` characters.
[[nodiscard]] std::string fitted(std::string_view utf8, std::size_t width);

}  // namespace rig::host
