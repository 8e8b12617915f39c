// The part of `headrig calibrate cameras` that takes the pictures: --live.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "firmware_host/companion/calibrate/board.hpp"

namespace rig::host {

struct LiveOptions {
    std::vector<std::string> sources;  // [NAME=]SOURCE, one a camera; picture_stream.hpp has the sources
    std::string shots;                 // folder; empty: beside the result
    bool go_on = false;                // from the shots that are there
};

// Watches the cameras until enough was taken, Enter, Ctrl-C or their end, and says what it does. On kExitOk
// `images` names a folder of shots a camera; everything else is said already and is the exit code.
[[nodiscard]] int take_live_shots(const LiveOptions& options, const BoardSpec& board,
                                  const std::filesystem::path& result, std::vector<std::string>& images);

}  // namespace rig::host
