// What verbs say to a person: progress, errors, and whether anybody looks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace rig::host {

// True when standard error is a terminal: colours and moving bars are for people only.
[[nodiscard]] bool is_interactive();

// Characters in a row of the terminal behind standard error; 80 when it does not say.
[[nodiscard]] std::size_t error_columns();

// "headrig: <message>" on standard error.
void print_error(std::string_view message);

// A bar on standard error for anything over two seconds; on a pipe one plain line every ten percent.
class Progress {
  public:
    Progress(std::string_view what, std::uint64_t total);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;
    void update(std::uint64_t done, std::string_view note = {});

  private:
    std::string what_;
    std::uint64_t total_;
    std::int64_t started_ms_;
    std::int64_t drawn_ms_ = 0;
    int tenth_ = 0;
    bool drawn_ = false;
};

// "BEGIN:END", frames from 0, END not included; nothing for anything else, or an empty range.
struct FrameRange {
    std::size_t begin = 0;
    std::size_t end = 0;
};
[[nodiscard]] std::optional<FrameRange> read_frame_range(std::string_view text);

// True after Ctrl-C or SIGTERM, once install_interrupt_handler() ran.
void install_interrupt_handler();
[[nodiscard]] bool interrupted();
// For a verb that Ctrl-C takes from one part of its work to the next.
void clear_interrupt();

// True when a person has pressed Enter since the last call; never when standard input is no terminal.
[[nodiscard]] bool enter_pressed();

}  // namespace rig::host
