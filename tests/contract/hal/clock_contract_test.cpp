// The contract of hal/clock.hpp, on every backend.
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>
#include <list>
#include <memory>
#include <string>
#include <thread>

#include "hal/linux/monotonic_clock.hpp"
#include "hal/sim/manual_clock.hpp"
#include "hal/sim/world_client.hpp"
#include "tests/contract/hal/fake_world.hpp"

namespace rig::test {
namespace {

class ClockBench {
  public:
    virtual ~ClockBench() = default;
    [[nodiscard]] virtual Clock& clock() = 0;
    // Far enough ahead that a sleeper is still asleep when the test interrupts it.
    [[nodiscard]] virtual std::int64_t far_ahead_us() const { return 3'600'000'000; }
    [[nodiscard]] virtual bool sleepers_wait() const { return true; }
};

class MonotonicBench final : public ClockBench {
  public:
    Clock& clock() override { return clock_; }

  private:
    MonotonicClock clock_;
};

class AdvancingBench final : public ClockBench {
  public:
    Clock& clock() override { return clock_; }
    bool sleepers_wait() const override { return false; }

  private:
    sim::ManualClock clock_{1000, sim::SleepMode::kAdvances};
};

// Moved on by another thread, 1 ms of its time in each 0.2 ms.
class DrivenBench final : public ClockBench {
  public:
    DrivenBench() : driver_([this] { drive(); }) {}
    ~DrivenBench() override {
        stopping_ = true;
        driver_.join();
    }
    Clock& clock() override { return clock_; }

  private:
    void drive() {
        while (!stopping_) {
            clock_.advance_by_us(1000);
            std::this_thread::sleep_for(std::chrono::microseconds(200));
        }
    }
    sim::ManualClock clock_{-5000, sim::SleepMode::kWaits};
    std::atomic<bool> stopping_{false};
    std::thread driver_;
};

class WorldBench final : public ClockBench {
  public:
    explicit WorldBench(sim::WorldPace pace) : world_(pace), pace_(pace) {
        talker_ = std::thread([this] { talk(); });
        client_ = std::move(*sim::WorldClient::connect(world_.path()));
    }
    // The client goes first: in lockstep it reads only while something waits, so after a stall of this thread
    // the talker sits in a full socket (some 280 messages), and only the other end's closing gets it out.
    ~WorldBench() override {
        stopping_ = true;
        client_.reset();
        talker_.join();
    }
    Clock& clock() override { return client_->clock(); }

  private:
    void talk() {
        world_.accept_and_greet();
        for (std::int64_t time_us = 1000; !stopping_ && pace_ == sim::WorldPace::kLockstep; time_us += 1000) {
            world_.send(plain(sim::WorldMessageKind::kAdvance, time_us));
            std::this_thread::sleep_for(std::chrono::microseconds(200));
        }
    }
    FakeWorld world_;
    sim::WorldPace pace_;
    std::atomic<bool> stopping_{false};
    std::thread talker_;
    std::unique_ptr<sim::WorldClient> client_;
};

struct ClockBackend {
    const char* name;
    std::unique_ptr<ClockBench> (*make)();
};

class ClockContract : public testing::TestWithParam<ClockBackend> {
  protected:
    std::unique_ptr<ClockBench> bench_ = GetParam().make();
    Clock& clock_ = bench_->clock();
};

TEST_P(ClockContract, NeverDecreases) {
    std::int64_t last_us = clock_.now_us();
    for (int i = 0; i < 20000; ++i) {
        const std::int64_t now_us = clock_.now_us();
        ASSERT_GE(now_us, last_us);
        last_us = now_us;
    }
}

TEST_P(ClockContract, SleepEndsAtOrAfterItsDeadline) {
    for (const std::int64_t step_us : {1, 100, 1500, 20'000}) {
        const std::int64_t deadline_us = clock_.now_us() + step_us;
        clock_.sleep_until_us(deadline_us);
        EXPECT_GE(clock_.now_us(), deadline_us);
    }
}

TEST_P(ClockContract, PassedDeadlineReturnsAtOnce) {
    clock_.sleep_until_us(clock_.now_us());
    clock_.sleep_until_us(clock_.now_us() - 1'000'000);
}

// A thread that sleeps on a clock. interrupt() is for those who sleep already, and on a starved machine no
// wait of fixed length makes sure of that: the kernel is asked.
class Sleeper {
  public:
    Sleeper(Clock& clock, std::int64_t deadline_us)
        : thread_([this, &clock, deadline_us] {
              number_ = gettid();
              clock.sleep_until_us(deadline_us);
              awake_ = true;
          }) {}
    ~Sleeper() { join(); }

    // Seen asleep several times in a row: a clock that others drive wakes its sleepers for a look at the
    // time.
    void wait_until_asleep() const {
        for (int looks = 0; looks < 5 && !awake_;) {
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
            looks = number_ != 0 && state() == 'S' ? looks + 1 : 0;
        }
    }
    [[nodiscard]] bool awake() const { return awake_; }
    [[nodiscard]] pthread_t handle() { return thread_.native_handle(); }
    void join() {
        if (thread_.joinable()) thread_.join();
    }

  private:
    // proc(5): "number (name) state ...".
    [[nodiscard]] char state() const {
        std::ifstream file("/proc/self/task/" + std::to_string(number_) + "/stat");
        std::string line;
        std::getline(file, line);
        const std::size_t name_end = line.rfind(") ");
        return name_end == std::string::npos ? '?' : line[name_end + 2];
    }
    std::atomic<pid_t> number_{0};
    std::atomic<bool> awake_{false};
    std::thread thread_;
};

TEST_P(ClockContract, InterruptWakesEveryCurrentSleeper) {
    if (!bench_->sleepers_wait()) GTEST_SKIP() << "sleeping moves this clock, nobody waits";
    const bool one_thread_only = std::string(GetParam().name) == "WorldLockstep";
    std::list<Sleeper> sleepers;
    const std::int64_t deadline_us = clock_.now_us() + bench_->far_ahead_us();
    for (int i = 0; i < (one_thread_only ? 1 : 3); ++i) sleepers.emplace_back(clock_, deadline_us);
    for (Sleeper& sleeper : sleepers) sleeper.wait_until_asleep();
    for (Sleeper& sleeper : sleepers) EXPECT_FALSE(sleeper.awake());
    clock_.interrupt();
    for (Sleeper& sleeper : sleepers) sleeper.join();
    EXPECT_LT(clock_.now_us(), deadline_us);
}

Clock* signalled_clock = nullptr;

TEST_P(ClockContract, InterruptWorksInASignalHandler) {
    if (!bench_->sleepers_wait()) GTEST_SKIP() << "sleeping moves this clock, nobody waits";
    signalled_clock = &clock_;
    std::signal(SIGUSR1, [](int) { signalled_clock->interrupt(); });
    const std::int64_t deadline_us = clock_.now_us() + bench_->far_ahead_us();
    Sleeper sleeper(clock_, deadline_us);
    sleeper.wait_until_asleep();
    pthread_kill(sleeper.handle(), SIGUSR1);
    sleeper.join();
    EXPECT_LT(clock_.now_us(), deadline_us);
}

INSTANTIATE_TEST_SUITE_P(
    Backends, ClockContract,
    testing::Values(
        ClockBackend{"Monotonic",
                     []() -> std::unique_ptr<ClockBench> { return std::make_unique<MonotonicBench>(); }},
        ClockBackend{"ManualAdvancing",
                     []() -> std::unique_ptr<ClockBench> { return std::make_unique<AdvancingBench>(); }},
        ClockBackend{"ManualDriven",
                     []() -> std::unique_ptr<ClockBench> { return std::make_unique<DrivenBench>(); }},
        ClockBackend{"WorldLockstep",
                     []() -> std::unique_ptr<ClockBench> {
                         return std::make_unique<WorldBench>(sim::WorldPace::kLockstep);
                     }},
        ClockBackend{"WorldRealTime",
                     []() -> std::unique_ptr<ClockBench> {
                         return std::make_unique<WorldBench>(sim::WorldPace::kRealTime);
                     }}),
    [](const auto& backend) { return std::string(backend.param.name); });

}  // namespace
}  // namespace rig::test
