// CRC-32C (Castagnoli, reflected polynomial 0x82F63B78, initial and final value 0xFFFFFFFF): the check of
// every frame. Not for: authenticity. Anybody can compute it.
#pragma once

#include <cstdint>

#include "core/base/bytes.hpp"

namespace rig {

// Check value: crc32c of the nine bytes "123456789" is 0xE3069283.
[[nodiscard]] std::uint32_t crc32c(ByteSpan bytes);

}  // namespace rig
