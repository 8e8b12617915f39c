#include "firmware_host/companion/monitor/terminal.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace rig::host {

namespace {

void put(std::string_view text) {
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
}

}  // namespace

bool can_draw() {
    const char* kind = std::getenv("TERM");
    return isatty(STDOUT_FILENO) == 1 && kind != nullptr && std::string_view(kind) != "dumb";
}

AlternateScreen::AlternateScreen() {
    put("\x1b[?1049h\x1b[?25l\x1b[2J");
}

AlternateScreen::~AlternateScreen() {
    put("\x1b[0m\x1b[?25h\x1b[?1049l");
}

ScreenSize AlternateScreen::size() const {
    winsize window{};
    if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &window) != 0 || window.ws_col == 0 || window.ws_row == 0) return {};
    return {window.ws_col, window.ws_row};
}

void AlternateScreen::draw(const std::vector<std::string>& lines) {
    std::string text = "\x1b[H";
    for (std::size_t i = 0; i < lines.size(); ++i) {
        if (i > 0) text += "\r\n";
        text +=
            "\x1b[K" + lines[i];  // erased first: behind a full line the cursor still stands on its last cell
    }
    put(text + "\x1b[J");
}

}  // namespace rig::host
