// The bits of tracking, stabilisation and inference.
#pragma once

#include "tests/support/digest.hpp"

namespace rig {

// Two streams of a random face, as shuffled points and through two cameras: names, poses, expressions,
// completed markers; and planar similarities.
void add_tracking(test::Digest& digest);

}  // namespace rig
