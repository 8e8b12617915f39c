// How the taking of a neutral ended, in words for the person who asked (core/wire/PROTOCOL.md section 3.10).
#pragma once

#include <string_view>

#include "core/stabilise/neutral_capture.hpp"
#include "core/wire/session_messages.hpp"

namespace rig {

// "neutral taken: ..." or "neutral refused: ..."; empty while none has ended. `marker`: the name of the
// marker that the report tells of. Nothing is allocated.
[[nodiscard]] FixedText<120> neutral_text(const NeutralReport& report, std::string_view marker);

}  // namespace rig
