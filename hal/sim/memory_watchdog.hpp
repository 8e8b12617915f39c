// A watchdog that only remembers whether it would have ended the process.
#pragma once

#include <algorithm>
#include <cstdint>

#include "hal/clock.hpp"
#include "hal/watchdog.hpp"

namespace rig::sim {

class MemoryWatchdog final : public Watchdog {
  public:
    MemoryWatchdog(const Clock& clock, std::int64_t timeout_us) : clock_(clock), timeout_us_(timeout_us) {}
    void arm() override {
        armed_ = true;
        fed_us_ = clock_.now_us();
    }
    void feed() override {
        note_interval();
        fed_us_ = clock_.now_us();
        ++feeds_;
    }
    void disarm() override {
        note_interval();
        armed_ = false;
    }
    [[nodiscard]] std::int64_t timeout_us() const override { return timeout_us_; }

    [[nodiscard]] bool armed() const { return armed_; }
    [[nodiscard]] std::uint64_t feeds() const { return feeds_; }
    // True for good once the time-out has passed without a feed.
    [[nodiscard]] bool expired() {
        note_interval();
        return longest_us_ > timeout_us_;
    }
    [[nodiscard]] std::int64_t longest_interval_us() {
        note_interval();
        return longest_us_;
    }

  private:
    void note_interval() {
        if (armed_) longest_us_ = std::max(longest_us_, clock_.now_us() - fed_us_);
    }

    const Clock& clock_;
    std::int64_t timeout_us_;
    std::int64_t fed_us_ = 0;
    std::int64_t longest_us_ = 0;
    std::uint64_t feeds_ = 0;
    bool armed_ = false;
};

}  // namespace rig::sim
