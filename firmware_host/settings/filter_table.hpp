// The [smoothing] table of a board file or settings file; what may stand in it is above filter_settings.hpp.
#pragma once

#include <string>

#define TOML_EXCEPTIONS 0
#include <toml++/toml.h>

#include "firmware_host/settings/filter_settings.hpp"

namespace rig {

// "" or what is wrong with it. `table`: the [smoothing] table itself.
[[nodiscard]] std::string read_filter_settings(const toml::table& table, FilterSettings& into);

}  // namespace rig
