// Every message of the wire through one door, for tests that hold for all of them.
#pragma once

#include <cstddef>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/base/result.hpp"
#include "core/wire/frame.hpp"

namespace rig::test {

// Decodes the payload by its type and encodes the result again. Because every layout is canonical, a payload
// that is accepted must come back byte for byte. kRange for an unknown type.
[[nodiscard]] Result<std::vector<std::byte>, WireError> reencoded(MessageType type, ByteSpan payload);

[[nodiscard]] std::vector<std::byte> framed(const FrameHead& head, ByteSpan payload);

}  // namespace rig::test
