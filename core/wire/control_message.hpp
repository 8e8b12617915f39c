// An artist's controls on the wire: a list of edits, each absolute, so a message may be repeated. Layout:
// PROTOCOL.md section 3.11. Not for: what a control does (core/solve/controls.hpp), names and regions (the
// host knows them, the board knows indices).
#pragma once

#include <cstdint>

#include "core/base/bounded_vector.hpp"
#include "core/base/bytes.hpp"
#include "core/base/control_edit.hpp"
#include "core/base/result.hpp"
#include "core/wire/frame.hpp"
#include "core/wire/wire_error.hpp"

namespace rig {

inline constexpr std::uint8_t kControlLayout = 1;  // of this message alone; the protocol stays 1
inline constexpr std::size_t kControlHeadBytes = 4;
inline constexpr std::size_t kControlEditBytes = 48;
inline constexpr std::size_t kMaxControlEdits =
    (kMaxWirePayloadBytes - kControlHeadBytes) / kControlEditBytes;  // 13

struct ControlMessage {
    bool neutral_first = false;  // every control to neutral, every pair untied, before the edits
    BoundedVector<ControlEdit, kMaxControlEdits> edits;
};

// encode: kRange for an edit that is_valid() refuses; kSpace. decode: also kVersion for another layout and
// kLength for a payload that its count does not give.
[[nodiscard]] Result<std::size_t, WireError> encode(const ControlMessage& message, MutableByteSpan into);
[[nodiscard]] Result<ControlMessage, WireError> decode_control(ByteSpan payload);

}  // namespace rig
