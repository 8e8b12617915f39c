// What only the kernel can tell a process about itself, or do for it.
#pragma once

#include <cstdint>

namespace rig::os {

// Largest resident memory so far.
[[nodiscard]] std::uint32_t peak_memory_kb();

// Keeps all memory of the process in RAM and gives the calling thread a real-time priority. False when the
// system does not allow it; then nothing has changed for the worse.
[[nodiscard]] bool become_real_time();

// A host that goes away shows as an error of write(), not as the end of the process.
void ignore_broken_pipes();

// SIGTERM and SIGINT call `stop`, which must be async-signal-safe.
void on_stop_signal(void (*stop)());

}  // namespace rig::os
