// Socket, shared memory and reading loop behind WorldClient. Inside hal/sim only.
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "core/base/bytes.hpp"
#include "hal/linux/descriptor.hpp"
#include "hal/linux/monotonic_clock.hpp"
#include "hal/sim/world_client.hpp"
#include "hal/sim/world_ledger.hpp"

namespace rig::sim {

class WorldClient::Connection {
  public:
    // How a wait ended.
    enum class Wake : std::uint8_t { kMessage, kDeadline, kInterrupt, kDown };
    using Lock = std::unique_lock<std::mutex>;

    [[nodiscard]] static Result<std::unique_ptr<Connection>, WorldError> connect(
        const std::string& socket_path, WorldPatience patience);
    ~Connection();
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

    [[nodiscard]] const WorldHello& hello() const { return hello_; }
    [[nodiscard]] bool lockstep() const { return hello_.pace == WorldPace::kLockstep; }
    [[nodiscard]] std::int64_t now_us() const;
    [[nodiscard]] const std::uint8_t* image(std::uint32_t slot, std::size_t camera) const;

    // Everything below that takes a Lock needs it held.
    [[nodiscard]] Lock lock() { return Lock(mutex_); }
    [[nodiscard]] WorldLedger& ledger() { return *ledger_; }
    // Waits for the next message, at most until deadline_us of this world's clock.
    [[nodiscard]] Wake wait_message(Lock& lock, std::int64_t deadline_us);
    void send(const WorldMessage& message, const Lock& lock);
    void send_freed_slots(const Lock& lock);
    [[nodiscard]] bool is_down() const { return fault_.load() != nullptr; }
    [[nodiscard]] const char* fault() const { return fault_.load(); }

    void sleep_until_us(std::int64_t deadline_us);
    void interrupt();  // async-signal-safe

  private:
    explicit Connection(WorldPatience patience) : patience_(patience) {}
    [[nodiscard]] bool dial(const std::string& socket_path);
    [[nodiscard]] bool receive_hello(os::Descriptor& memory);
    [[nodiscard]] bool map(const os::Descriptor& memory);
    void start_reader();
    void read_until_down();
    [[nodiscard]] Wake wait_readable(std::int64_t timeout_us);
    void receive_bytes();
    [[nodiscard]] bool accept_message(const Lock& lock);
    void go_down(const char* fault);

    WorldPatience patience_;
    MonotonicClock monotonic_;
    os::Descriptor socket_;
    os::Descriptor interrupt_event_;
    WorldHello hello_;
    std::byte* memory_ = nullptr;
    std::unique_ptr<WorldLedger> ledger_;
    std::mutex mutex_;
    std::condition_variable arrived_;
    std::atomic<std::int64_t> world_time_us_{0};
    std::atomic<const char*> fault_{nullptr};
    std::array<std::byte, 64 * sizeof(WorldMessage)> inbox_{};
    std::size_t inbox_bytes_ = 0;
    bool hung_up_ = false;  // the world takes no more messages
    std::atomic<bool> stopping_{false};
    std::thread reader_;
};

}  // namespace rig::sim
