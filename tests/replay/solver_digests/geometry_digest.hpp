// The same for lenses, views and mounts: what core/geometry makes of random cameras and pixels.
#pragma once

#include "tests/support/digest.hpp"

namespace rig {

void add_geometry(test::Digest& digest);

}  // namespace rig
