// A kernel whose n-th system call fails. The test program links with --wrap for the calls listed in
// fake_kernel.cpp.
#pragma once

#include <cstdint>
#include <string_view>

namespace rig::test {

// From now on wrapped calls are counted from 0; call number `nth` fails with `error_number` (and sets
// nothing). With `forever`, every later one fails too.
void fail_call(std::uint64_t nth, int error_number, bool forever = false);
void heal();
[[nodiscard]] std::uint64_t calls_made();  // since fail_call() or heal()
[[nodiscard]] bool has_failed();           // the planned failure has happened
[[nodiscard]] std::string_view failed_call();

// From now on reads and writes move at most this many bytes at a time; 0: no limit.
void limit_transfers(std::uint64_t bytes);

[[nodiscard]] int open_descriptors();

}  // namespace rig::test
