// What a capture says to the person who holds the board. Pure: the same status gives the same lines.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "firmware_host/companion/capture/shot_capture.hpp"

namespace rig::host {

// One line for the whole, one a camera, one that says what to do next; plain text.
[[nodiscard]] std::vector<std::string> capture_lines(const CaptureStatus& status,
                                                     std::span<const std::string> names);

// The same in one line, for pipes and logs.
[[nodiscard]] std::string capture_line(const CaptureStatus& status, std::span<const std::string> names);

// Why the capture ended, and the remedy. `shots`: the folder that they are in.
[[nodiscard]] std::string capture_end_text(const CaptureEnd& end, std::span<const std::string> names,
                                           const std::string& shots);

}  // namespace rig::host
