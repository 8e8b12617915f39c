// Time that moves only when a test or a simulation says so.
#pragma once

#include <atomic>
#include <cstdint>

#include "hal/clock.hpp"

namespace rig::sim {

enum class SleepMode : std::uint8_t {
    kWaits,     // a sleeper waits until another thread moves the clock
    kAdvances,  // sleeping itself moves the clock to the deadline: for a single thread
};

class ManualClock final : public Clock {
  public:
    explicit ManualClock(std::int64_t start_us = 0, SleepMode mode = SleepMode::kAdvances)
        : now_us_(start_us), mode_(mode) {}
    [[nodiscard]] std::int64_t now_us() const override { return now_us_.load(std::memory_order_acquire); }
    void sleep_until_us(std::int64_t deadline_us) override;
    void interrupt() override;

    // A time before now changes nothing: the clock never goes back.
    void advance_to_us(std::int64_t time_us);
    void advance_by_us(std::int64_t step_us) { advance_to_us(now_us() + step_us); }

  private:
    std::atomic<std::int64_t> now_us_;
    std::atomic<std::uint32_t> interrupts_{0};
    std::atomic<std::uint32_t> changes_{0};  // of either; what sleepers wait on
    SleepMode mode_;
};

}  // namespace rig::sim
