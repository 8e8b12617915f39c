// The other side of the world boundary, small enough to be wrong on purpose.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "hal/linux/descriptor.hpp"
#include "hal/sim/world_protocol.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::test {

// Two cameras of 8x6 px, four slots, 100 Hz.
[[nodiscard]] sim::WorldHello small_hello(sim::WorldPace pace);

class FakeWorld {
  public:
    // Listens at once. `memory_bytes`: the real size of the shared memory, whatever the hello claims.
    FakeWorld(sim::WorldHello hello, std::uint64_t memory_bytes);
    explicit FakeWorld(sim::WorldPace pace) : FakeWorld(small_hello(pace), small_hello(pace).memory_bytes) {}
    ~FakeWorld();
    FakeWorld(const FakeWorld&) = delete;
    FakeWorld& operator=(const FakeWorld&) = delete;

    [[nodiscard]] std::string path() const { return folder_ / "world.sock"; }

    // Step by step, from any one thread.
    void accept_and_greet();
    void accept_and_send(std::span<const std::byte> bytes, bool with_memory);
    void send(const sim::WorldMessage& message);
    void send_bytes(std::span<const std::byte> bytes);
    [[nodiscard]] bool receive(sim::WorldMessage& message, int patience_ms = 2000);
    void hang_up() { connection_.reset(); }

    // By a thread of its own: greets, delivers `frames` frame sets (image value = sequence * 16 + camera) and
    // ends. Lockstep: waits for every tick to be done. Real time: at the hello's rate, dropping when no slot
    // is free.
    void perform(std::uint32_t frames);
    void wait_performed();

    [[nodiscard]] std::vector<sim::WorldMessage> controls() const {
        return controls_;
    }  // after wait_performed()
    void paint(std::uint32_t slot, std::uint32_t sequence);

  private:
    void play(std::uint32_t frames);
    void note(const sim::WorldMessage& message);
    [[nodiscard]] bool wait_free_slot(std::uint32_t& slot, bool patient);

    TempFolder folder_;
    sim::WorldHello hello_;
    os::Descriptor listener_;
    os::Descriptor connection_;
    os::Descriptor memory_;
    std::vector<bool> slot_free_;
    std::uint32_t done_sequence_ = 0;
    std::vector<sim::WorldMessage> controls_;
    std::thread thread_;
    std::atomic<bool> stopping_{false};
};

[[nodiscard]] sim::WorldMessage frame_set(std::uint32_t slot, std::uint32_t sequence, std::int64_t time_us,
                                          std::uint8_t camera_mask = 3);
[[nodiscard]] sim::WorldMessage line_edge(sim::WorldLine line, bool active, std::int64_t time_us);
[[nodiscard]] sim::WorldMessage plain(sim::WorldMessageKind kind, std::int64_t time_us = 0);

}  // namespace rig::test
