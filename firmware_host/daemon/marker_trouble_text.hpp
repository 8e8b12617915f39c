// Which markers came off or slid (F18), in one line for people (core/wire/PROTOCOL.md section 3.8).
#pragma once

#include <span>
#include <string_view>

#include "core/pipeline/frame_types.hpp"
#include "core/wire/session_messages.hpp"

namespace rig {

// "marker LL_M has come off; marker MC_L has slid by 2.1 mm"; what does not fit is counted ("; and 3 more").
// Empty when none is in trouble. `names`: of the pack's markers; one without a name is told by its number.
// Nothing is allocated.
[[nodiscard]] FixedText<120> marker_trouble_text(const FrameReport& report,
                                                 std::span<const std::string_view> names);

}  // namespace rig
