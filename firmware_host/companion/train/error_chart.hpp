// Draws errors against counts, one line a method: the picture of [Chuang02 Fig. 6].
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "firmware_host/companion/files/file_error.hpp"

namespace rig::host {

struct ErrorLine {
    std::string name;
    std::array<std::uint8_t, 3> rgb{};
    std::vector<double> counts;  // rising; a single one is drawn as a dot
    std::vector<double> errors;  // >= 0
};

// .png only. x: counts, y: errors in `unit`, from 0.
[[nodiscard]] Result<void, FileError> draw_errors(const std::filesystem::path& path,
                                                  const std::vector<ErrorLine>& lines,
                                                  const std::string& title, const std::string& count_label,
                                                  const std::string& unit);

}  // namespace rig::host
