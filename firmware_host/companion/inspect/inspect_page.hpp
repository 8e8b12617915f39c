// The page of `headrig inspect`: one self-contained HTML document about a take.
#pragma once

#include <string>

#include "firmware_host/companion/inspect/take_record.hpp"

namespace rig::host {

// The same record gives the same bytes. A take without ticks gets a page that says so.
[[nodiscard]] std::string inspect_page(const TakeRecord& record);

}  // namespace rig::host
