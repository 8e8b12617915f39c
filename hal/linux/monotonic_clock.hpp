// CLOCK_MONOTONIC: the time of a real board. Wall-clock time never appears.
#pragma once

#include <atomic>
#include <cstdint>

#include "hal/clock.hpp"

namespace rig {

// interrupt() wakes the sleepers of this object, not those of another one.
class MonotonicClock final : public Clock {
  public:
    [[nodiscard]] std::int64_t now_us() const override;
    void sleep_until_us(std::int64_t deadline_us) override;
    void interrupt() override;

  private:
    std::atomic<std::uint32_t> interrupts_{0};
    static_assert(std::atomic<std::uint32_t>::is_always_lock_free,
                  "interrupt() is called from signal handlers");
};

}  // namespace rig
