#include "hal/linux/process.hpp"

#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include "hal/linux/system_call.hpp"

namespace rig::os {

namespace {

constexpr int kSolverPriority =
    50;  // the middle of SCHED_FIFO: above all ordinary work, below the kernel's own threads
void (*stop_action)() = nullptr;

}  // namespace

std::uint32_t peak_memory_kb() {
    rusage usage{};
    if (!system_call([&] { return getrusage(RUSAGE_SELF, &usage); }).done()) return 0;
    return static_cast<std::uint32_t>(usage.ru_maxrss);
}

bool become_real_time() {
    const bool locked = system_call([] { return mlockall(MCL_CURRENT | MCL_FUTURE); }).done();
    sched_param parameters{};
    parameters.sched_priority = kSolverPriority;
    const bool raised = system_call([&] { return sched_setscheduler(0, SCHED_FIFO, &parameters); }).done();
    return locked && raised;
}

void ignore_broken_pipes() {
    signal(SIGPIPE, SIG_IGN);
}

void on_stop_signal(void (*stop)()) {
    stop_action = stop;
    struct sigaction action{};
    action.sa_handler = [](int) { stop_action(); };
    static_cast<void>(system_call([&] { return sigaction(SIGTERM, &action, nullptr); }));
    static_cast<void>(system_call([&] { return sigaction(SIGINT, &action, nullptr); }));
}

}  // namespace rig::os
