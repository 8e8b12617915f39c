// The text form of a take, CSV `frame,time_s,<shape names>`. README.md of the folder above is the format.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "firmware_host/companion/rig_folder/rig_folder.hpp"

namespace rig::host {

// `name` stands for the file in errors. What comes out has the shapes of `shape_names`, in that order.
[[nodiscard]] Result<Take, FileError> parse_take(std::string_view text, const std::filesystem::path& name,
                                                 const std::vector<std::string>& shape_names);

}  // namespace rig::host
