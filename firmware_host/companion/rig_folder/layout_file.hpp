// The text form of a marker layout, markers_<n>.csv. README.md of this folder is the format.
#pragma once

#include <filesystem>
#include <string_view>

#include "firmware_host/companion/rig_folder/rig_folder.hpp"

namespace rig::host {

// `name` stands for the file in errors. Columns are found by name; marker, x_mm..z_mm and rms_mm may be
// absent (the neutral position then follows from the mesh). What comes out has passed check_layout().
[[nodiscard]] Result<MarkerLayout, FileError> parse_layout(std::string_view text,
                                                           const std::filesystem::path& name, const Rig& rig);

}  // namespace rig::host
