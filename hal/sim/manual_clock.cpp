#include "hal/sim/manual_clock.hpp"

namespace rig::sim {

void ManualClock::sleep_until_us(std::int64_t deadline_us) {
    if (mode_ == SleepMode::kAdvances) {
        advance_to_us(deadline_us);
        return;
    }
    const std::uint32_t interrupts = interrupts_.load();
    while (true) {
        const std::uint32_t seen = changes_.load();
        if (now_us() >= deadline_us || interrupts_.load() != interrupts) return;
        changes_.wait(seen);
    }
}

void ManualClock::interrupt() {
    interrupts_.fetch_add(1);
    changes_.fetch_add(1);
    changes_.notify_all();
}

void ManualClock::advance_to_us(std::int64_t time_us) {
    std::int64_t now = now_us_.load();
    while (now < time_us && !now_us_.compare_exchange_weak(now, time_us)) {
    }
    changes_.fetch_add(1);
    changes_.notify_all();
}

}  // namespace rig::sim
