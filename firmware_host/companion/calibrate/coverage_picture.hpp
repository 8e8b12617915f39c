// A picture of where in a camera's image the board was seen, and how well the lens explains it there.
#pragma once

#include <filesystem>
#include <string>

#include "firmware_host/companion/calibrate/calibration.hpp"

namespace rig::host {

// PNG of the camera's size, enlarged: fields without a point are dark, each point is a dot from green (no
// residual) to red (0.3 px and more), its residual a line 100 times as long.
[[nodiscard]] Result<void, FileError> draw_coverage(const std::filesystem::path& path,
                                                    const Calibration& calibration, std::size_t camera,
                                                    const std::string& title);

}  // namespace rig::host
