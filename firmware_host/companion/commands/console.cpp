#include "firmware_host/companion/commands/console.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdio>

namespace rig::host {

namespace {

constexpr std::int64_t kQuietMs = 2000;
constexpr std::int64_t kRedrawMs = 100;

volatile std::sig_atomic_t g_interrupted = 0;

std::int64_t now_ms() {
    using std::chrono::steady_clock;
    return std::chrono::duration_cast<std::chrono::milliseconds>(steady_clock::now().time_since_epoch())
        .count();
}

void on_interrupt(int) {
    g_interrupted = 1;
}

}  // namespace

bool is_interactive() {
    return isatty(STDERR_FILENO) == 1;
}

std::size_t error_columns() {
    winsize window{};
    return ioctl(STDERR_FILENO, TIOCGWINSZ, &window) == 0 && window.ws_col > 0 ? window.ws_col : 80;
}

void print_error(std::string_view message) {
    fmt::print(stderr, "headrig: {}\n", message);
}

Progress::Progress(std::string_view what, std::uint64_t total)
    : what_(what), total_(total), started_ms_(now_ms()) {}

Progress::~Progress() {
    if (drawn_ && is_interactive()) fmt::print(stderr, "\r\x1b[K");
}

void Progress::update(std::uint64_t done, std::string_view note) {
    const std::int64_t now = now_ms();
    if (now - started_ms_ < kQuietMs) return;
    const double fraction =
        total_ == 0 ? 0.0 : std::min(1.0, static_cast<double>(done) / static_cast<double>(total_));
    if (!is_interactive()) {
        const int tenth = static_cast<int>(fraction * 10.0);
        if (tenth <= tenth_ && drawn_) return;
        tenth_ = tenth;
        drawn_ = true;
        fmt::print(stderr, "{}: {} % ({} of {}) {}\n", what_, tenth * 10, done, total_, note);
        return;
    }
    if (drawn_ && now - drawn_ms_ < kRedrawMs && done < total_) return;
    drawn_ms_ = now;
    drawn_ = true;
    const int filled = static_cast<int>(fraction * 30.0);
    fmt::print(stderr, "\r\x1b[K{} [{:#<{}}{:.<{}}] {:3.0f} % {}", what_, "", filled, "", 30 - filled,
               fraction * 100.0, note);
    std::fflush(stderr);
}

std::optional<FrameRange> read_frame_range(std::string_view text) {
    const std::size_t colon = text.find(':');
    if (colon == std::string_view::npos) return std::nullopt;
    FrameRange range;
    const auto read = [](std::string_view part, std::size_t& value) {
        const auto result = std::from_chars(part.data(), part.data() + part.size(), value);
        return result.ec == std::errc{} && result.ptr == part.data() + part.size();
    };
    if (!read(text.substr(0, colon), range.begin) || !read(text.substr(colon + 1), range.end))
        return std::nullopt;
    if (range.begin >= range.end) return std::nullopt;
    return range;
}

void install_interrupt_handler() {
    struct sigaction action{};
    action.sa_handler = on_interrupt;
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() {
    return g_interrupted != 0;
}

void clear_interrupt() {
    g_interrupted = 0;
}

bool enter_pressed() {
    if (isatty(STDIN_FILENO) != 1) return false;
    pollfd waiting{STDIN_FILENO, POLLIN, 0};
    if (poll(&waiting, 1, 0) != 1 || (waiting.revents & POLLIN) == 0) return false;
    std::array<char, 256> line{};  // the terminal hands lines on whole
    return read(STDIN_FILENO, line.data(), line.size()) > 0;
}

}  // namespace rig::host
