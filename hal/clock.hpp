// Time for everything above the HAL. Never wall-clock time.
#pragma once

#include <cstdint>

namespace rig {

// Microseconds since an arbitrary start. Contract: now_us() never decreases; sleep_until_us() returns at or
// after the deadline on this same clock (at once when it has passed) or early after interrupt(). Safe from
// any thread.
class Clock {
  public:
    virtual ~Clock() = default;
    [[nodiscard]] virtual std::int64_t now_us() const = 0;
    virtual void sleep_until_us(std::int64_t deadline_us) = 0;
    // Wakes every current sleeper; async-signal-safe.
    virtual void interrupt() = 0;
};

}  // namespace rig
