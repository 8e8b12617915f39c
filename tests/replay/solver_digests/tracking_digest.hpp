// The bits of tracking and stabilisation.
#pragma once

#include "tests/support/digest.hpp"

namespace rig {

// Two streams of a random face, as shuffled points and through two cameras: names, poses, expressions; and
// planar similarities.
void add_tracking(test::Digest& digest);

}  // namespace rig
