// Restarts the process when ticks stop being completed.
#pragma once

#include <cstdint>

namespace rig {

// Contract: after arm(), feed() must be called at least every timeout_us() or the process is ended from
// outside. Only a completed tick feeds it. Never blocks. disarm() for a clean end.
class Watchdog {
  public:
    virtual ~Watchdog() = default;
    virtual void arm() = 0;
    virtual void feed() = 0;
    virtual void disarm() = 0;
    [[nodiscard]] virtual std::int64_t timeout_us() const = 0;  // 0: not supervised
};

}  // namespace rig
