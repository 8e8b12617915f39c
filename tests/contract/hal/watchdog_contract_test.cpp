// The contract of hal/watchdog.hpp, on every backend: who supervises sees arm, feeds and disarm, and nothing
// blocks.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <cstring>
#include <memory>
#include <string>

#include "hal/linux/descriptor.hpp"
#include "hal/linux/systemd_watchdog.hpp"
#include "hal/sim/manual_clock.hpp"
#include "hal/sim/memory_watchdog.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::test {
namespace {

constexpr std::int64_t kTimeout_us = 500'000;

class WatchdogBench {
  public:
    virtual ~WatchdogBench() = default;
    [[nodiscard]] virtual Watchdog& watchdog() = 0;
    [[nodiscard]] virtual int feeds_seen() = 0;  // since the last call; arming may count as the first
    [[nodiscard]] virtual bool supervised() = 0;
};

class MemoryBench final : public WatchdogBench {
  public:
    Watchdog& watchdog() override { return watchdog_; }
    int feeds_seen() override {
        const auto seen = static_cast<int>(watchdog_.feeds() - counted_);
        counted_ = watchdog_.feeds();
        return seen;
    }
    bool supervised() override { return watchdog_.armed(); }

  private:
    sim::ManualClock clock_;
    sim::MemoryWatchdog watchdog_{clock_, kTimeout_us};
    std::uint64_t counted_ = 0;
};

// A service manager that listens.
class SystemdBench final : public WatchdogBench {
  public:
    SystemdBench() {
        socket_ = os::Descriptor(::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0));
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        const std::string path = folder_ / "notify";
        std::memcpy(address.sun_path, path.c_str(), path.size());
        EXPECT_EQ(bind(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
        watchdog_ = std::make_unique<SystemdWatchdog>(path, kTimeout_us);
    }
    Watchdog& watchdog() override { return *watchdog_; }
    int feeds_seen() override {
        drain();
        const int seen = feeds_;
        feeds_ = 0;
        return seen;
    }
    bool supervised() override {
        drain();
        return ready_;
    }

  private:
    void drain() {
        std::array<char, 256> text{};
        ssize_t length = 0;
        while ((length = recv(socket_.get(), text.data(), text.size(), 0)) > 0) {
            const std::string message(text.data(), static_cast<std::size_t>(length));
            if (message.find("WATCHDOG=1") != std::string::npos) ++feeds_;
            if (message.find("READY=1") != std::string::npos) ready_ = true;
            if (message.find("STOPPING=1") != std::string::npos) ready_ = false;
        }
    }
    TempFolder folder_;
    os::Descriptor socket_;
    std::unique_ptr<SystemdWatchdog> watchdog_;
    int feeds_ = 0;
    bool ready_ = false;
};

struct WatchdogBackend {
    const char* name;
    std::unique_ptr<WatchdogBench> (*make)();
};

class WatchdogContract : public testing::TestWithParam<WatchdogBackend> {
  protected:
    std::unique_ptr<WatchdogBench> bench_ = GetParam().make();
};

TEST_P(WatchdogContract, ArmFeedDisarm) {
    Watchdog& watchdog = bench_->watchdog();
    EXPECT_EQ(watchdog.timeout_us(), kTimeout_us);
    EXPECT_FALSE(bench_->supervised());
    watchdog.arm();
    EXPECT_TRUE(bench_->supervised());
    static_cast<void>(bench_->feeds_seen());
    for (int i = 0; i < 5; ++i) watchdog.feed();
    EXPECT_EQ(bench_->feeds_seen(), 5);
    watchdog.disarm();
    EXPECT_FALSE(bench_->supervised());
}

TEST_P(WatchdogContract, ASupervisorThatDoesNotListenNeverBlocks) {
    bench_->watchdog().arm();
    for (int i = 0; i < 20'000; ++i) bench_->watchdog().feed();
    bench_->watchdog().disarm();
}

INSTANTIATE_TEST_SUITE_P(Backends, WatchdogContract,
                         testing::Values(WatchdogBackend{"Memory",
                                                         []() -> std::unique_ptr<WatchdogBench> {
                                                             return std::make_unique<MemoryBench>();
                                                         }},
                                         WatchdogBackend{"Systemd",
                                                         []() -> std::unique_ptr<WatchdogBench> {
                                                             return std::make_unique<SystemdBench>();
                                                         }}),
                         [](const auto& backend) { return std::string(backend.param.name); });

TEST(MemoryWatchdog, NoticesAMissedFeedForGood) {
    sim::ManualClock clock;
    sim::MemoryWatchdog watchdog(clock, 1000);
    watchdog.arm();
    clock.advance_by_us(1000);
    watchdog.feed();
    EXPECT_FALSE(watchdog.expired());
    clock.advance_by_us(1001);
    watchdog.feed();
    EXPECT_TRUE(watchdog.expired());
    EXPECT_EQ(watchdog.longest_interval_us(), 1001);
}

TEST(SystemdWatchdog, WithoutAManagerEverythingIsQuiet) {
    SystemdWatchdog watchdog("", 1000);
    watchdog.arm();
    watchdog.feed();
    watchdog.disarm();
    EXPECT_EQ(watchdog.timeout_us(), 0);
}

}  // namespace
}  // namespace rig::test
