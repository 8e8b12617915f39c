// The smallest rig that has everything: a bent sheet of nine vertices, two parts, two shapes, five markers.
#pragma once

#include "firmware_host/companion/rig_folder/rig_folder.hpp"

namespace rig::test {

[[nodiscard]] host::Rig small_rig();
[[nodiscard]] host::MarkerLayout small_layout(const host::Rig& rig);

}  // namespace rig::test
