#include "hal/linux/monotonic_clock.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <climits>

namespace rig {

namespace {

constexpr std::int64_t kMicrosPerSecond = 1'000'000;

timespec timespec_of(std::int64_t time_us) {
    timespec result{};
    result.tv_sec = static_cast<time_t>(time_us / kMicrosPerSecond);
    result.tv_nsec = static_cast<long>(time_us % kMicrosPerSecond) * 1000;
    return result;
}

}  // namespace

std::int64_t MonotonicClock::now_us() const {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return static_cast<std::int64_t>(now.tv_sec) * kMicrosPerSecond + now.tv_nsec / 1000;
}

// A futex with an absolute CLOCK_MONOTONIC deadline: one wake reaches every sleeper, none is lost between the
// load and the wait, and nothing has to be drained afterwards (a pipe or eventfd would need a reader elected
// among the sleepers).
void MonotonicClock::sleep_until_us(std::int64_t deadline_us) {
    const std::uint32_t seen = interrupts_.load(std::memory_order_acquire);
    while (interrupts_.load(std::memory_order_acquire) == seen && now_us() < deadline_us) {
        const timespec deadline = timespec_of(deadline_us);
        syscall(SYS_futex, &interrupts_, FUTEX_WAIT_BITSET_PRIVATE, seen, &deadline, nullptr,
                FUTEX_BITSET_MATCH_ANY);
    }
}

void MonotonicClock::interrupt() {
    interrupts_.fetch_add(1, std::memory_order_release);
    syscall(SYS_futex, &interrupts_, FUTEX_WAKE_PRIVATE, INT_MAX, nullptr, nullptr, 0);
}

}  // namespace rig
