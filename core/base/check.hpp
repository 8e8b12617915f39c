// Contract checks against our own bugs, always on. Bytes from outside never reach one.
#pragma once

namespace rig {

// Called when a RIG_CHECK fails. core's own definition traps; a program may link a strong one that prints
// first.
[[noreturn]] void check_failed(const char* file, int line, const char* condition);

}  // namespace rig

#define RIG_CHECK(condition)                                     \
    do {                                                         \
        if (!(condition)) [[unlikely]] {                         \
            ::rig::check_failed(__FILE__, __LINE__, #condition); \
        }                                                        \
    } while (false)
