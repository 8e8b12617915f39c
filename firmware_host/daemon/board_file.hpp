// What a board has, from its board.toml.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "firmware_host/settings/filter_settings.hpp"

namespace rig {

struct BoardCamera {
    std::string name;
    std::string source;  // what stands behind it: "world:0" is camera 0 of a simulated world
};

struct BoardLine {
    std::string name;    // what the daemon knows it as: "button_neutral", "live_led"
    std::string source;  // "world:1" is line 1 of a simulated world
};

struct Board {
    std::string name;
    double rate_hz = 60.0;
    int frozen_frames = 3;
    FilterSettings smoothing;  // unless the command line says otherwise
    std::string default_link;  // as --link takes it; "" when there is none
    std::vector<BoardCamera> cameras;
    std::vector<BoardLine> lines;

    [[nodiscard]] const BoardLine* line(const std::string& wanted) const;
};

// One sentence that names the file, the fault and the remedy.
struct BoardFileError {
    std::string message;
};

// `name` is a board's name, looked up as <folder>/<name>/board.toml, or the path of such a file.
[[nodiscard]] Result<Board, BoardFileError> load_board(const std::string& name,
                                                       const std::filesystem::path& folder);

}  // namespace rig
