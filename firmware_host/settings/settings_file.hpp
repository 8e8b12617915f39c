// A settings file: how to smooth and what an artist wants, for any pack.
//
//   [smoothing]                 # filter_settings.hpp
//   filter = "one-euro"
//   [controls.brows]            # control_settings.hpp: WHO, then CONTROL = VALUE
//   sparsity = 2
//   range = [0, 0.8]
//   [controls."jawLeft,jawRight"]
//   cancel = true
//
// Where regions overlap, the line that stands later in the file wins.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "firmware_host/settings/filter_settings.hpp"

namespace rig {

struct SettingsFile {
    FilterSettings smoothing;
    std::vector<std::string> controls;  // "brows.sparsity=2", in the order of the file
};

// A sentence that names the file, the line where there is one, and the fault.
[[nodiscard]] Result<SettingsFile, std::string> read_settings_file(const std::filesystem::path& path);

}  // namespace rig
