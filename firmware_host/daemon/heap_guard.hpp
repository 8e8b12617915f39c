// Counts heap calls after start-up. The program's own malloc and operator new stand in front of the C
// library's. Not for finding leaks, and not active in sanitizer builds, which bring their own allocator.
#pragma once

#include <cstdint>

namespace rig {

// From here on every heap call of any thread is counted; with RIG_HEAP_GUARD=abort in the environment the
// first one ends the program with a line that says so. Releasing memory counts as a heap call too.
void seal_heap();
// For the orderly end of the program.
void unseal_heap();
[[nodiscard]] std::uint32_t heap_calls_after_seal();
// False in builds whose allocator is not ours to watch.
[[nodiscard]] bool heap_guard_is_active();

}  // namespace rig
