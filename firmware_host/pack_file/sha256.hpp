// SHA-256 by libsodium, in the form that core/pack asks for.
#pragma once

#include "core/pack/pack_format.hpp"

namespace rig {

void sha256(ByteSpan bytes, Hash& digest);

}  // namespace rig
