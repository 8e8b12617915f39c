// The terminal behind standard output while the monitor draws on it.
#pragma once

#include <string>
#include <vector>

#include "firmware_host/companion/monitor/screen.hpp"

namespace rig::host {

// True when standard output is a terminal that can be drawn on.
[[nodiscard]] bool can_draw();

// Takes the alternate screen and hides the cursor; gives both back at destruction, so the shell's text is as
// before.
class AlternateScreen {
  public:
    AlternateScreen();
    ~AlternateScreen();
    AlternateScreen(const AlternateScreen&) = delete;
    AlternateScreen& operator=(const AlternateScreen&) = delete;

    // Of the terminal now; 80 x 24 when it does not say.
    [[nodiscard]] ScreenSize size() const;
    void draw(const std::vector<std::string>& lines);
};

}  // namespace rig::host
