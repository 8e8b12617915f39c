// Where a frame's time goes: pictures of two cameras through every stage, each timed on its own, and through
// the pipeline as a whole.
#pragma once

#include <cstddef>

namespace rig::test {

// Prints a table: thread CPU time of each stage, p50 and p99 over `frames` frames. 60 markers, 53 shapes, two
// pictures of 640 x 480 a frame.
void print_stage_times(std::size_t frames);

}  // namespace rig::test
