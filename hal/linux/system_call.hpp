// The one way from here to the kernel. Retries what only a signal interrupted, sorts every other outcome, and
// keeps errno inside hal/linux. Not for close(): Linux has released the descriptor even when close() reports
// EINTR.
#pragma once

#include <cerrno>
#include <cstdint>
#include <initializer_list>

namespace rig::os {

enum class Outcome : std::uint8_t {
    kDone,       // the call succeeded; `value` is what it returned
    kTolerated,  // it failed in a way the caller expects and listed
    kFailed,     // it failed otherwise
};

struct SystemResult {
    Outcome outcome = Outcome::kFailed;
    std::int64_t value = -1;
    int error_number = 0;  // for a choice inside hal/linux only

    [[nodiscard]] bool done() const { return outcome == Outcome::kDone; }
    [[nodiscard]] bool tolerated() const { return outcome == Outcome::kTolerated; }
    [[nodiscard]] bool failed() const { return outcome == Outcome::kFailed; }
};

// `call` returns -1 and sets errno on failure. A call that a signal interrupts for ever is cut off after 1000
// tries.
template <class Call>
[[nodiscard]] SystemResult system_call(Call call, std::initializer_list<int> tolerated = {}) {
    SystemResult result;
    for (int attempt = 0; attempt < 1000; ++attempt) {
        result.value = static_cast<std::int64_t>(call());
        if (result.value != -1) {
            result.outcome = Outcome::kDone;
            return result;
        }
        result.error_number = errno;
        if (result.error_number != EINTR) break;
    }
    for (const int expected : tolerated) {
        if (result.error_number == expected) result.outcome = Outcome::kTolerated;
    }
    return result;
}

}  // namespace rig::os
