// What the daemon's side knows of the world, and the rules for what the world may say next. No sockets, no
// time: bytes from outside are judged here, so this is what the tests and the fuzzer attack.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/bounded_vector.hpp"
#include "core/base/ring.hpp"
#include "hal/gpio_line.hpp"
#include "hal/sim/world_protocol.hpp"

namespace rig::sim {

inline constexpr std::uint32_t kMaxWorldSlots = 64;
inline constexpr std::uint64_t kMaxWorldMemoryBytes = std::uint64_t{4} << 30;

// True when every image of every slot lies inside the memory and every number is one this side can serve.
// `file_bytes`: the real size of the shared memory.
[[nodiscard]] bool hello_is_sound(const WorldHello& hello, std::uint64_t file_bytes);

struct QueuedFrame {
    std::uint32_t slot = 0;
    std::uint32_t sequence = 0;
    std::int64_t capture_us = 0;
    std::int64_t published_us = 0;
};

class WorldLedger {
  public:
    using SlotList = BoundedVector<std::uint32_t, kMaxWorldSlots>;

    explicit WorldLedger(const WorldHello& hello) : hello_(hello) {}

    // nullptr when the message keeps the protocol; otherwise which rule it breaks, and nothing has changed.
    [[nodiscard]] const char* accept(const WorldMessage& message);

    [[nodiscard]] std::int64_t time_us() const { return time_us_; }
    [[nodiscard]] bool ended() const { return ended_; }

    // A camera that does not listen gets no frames; its images free their slots at once.
    void listen(std::size_t camera, bool listens);
    [[nodiscard]] bool has_frame(std::size_t camera) const { return !queues_[camera].empty(); }
    // Precondition: has_frame().
    [[nodiscard]] QueuedFrame take_frame(std::size_t camera);
    // False when this camera does not hold this slot.
    [[nodiscard]] bool release(std::size_t camera, std::uint32_t slot);
    // Slots that nobody holds any more since the last call.
    [[nodiscard]] SlotList take_freed_slots();
    [[nodiscard]] std::uint64_t dropped_frames() const { return dropped_frames_; }

    // Lockstep: a frame set waits for its tick to be done.
    [[nodiscard]] bool tick_outstanding() const { return tick_outstanding_; }
    [[nodiscard]] std::uint32_t tick_sequence() const { return tick_sequence_; }
    void finish_tick() { tick_outstanding_ = false; }

    [[nodiscard]] bool line_active(std::size_t line) const { return lines_[line]; }
    [[nodiscard]] bool has_edge(std::size_t line) const { return !edges_[line].empty(); }
    // Precondition: has_edge().
    [[nodiscard]] EdgeEvent take_edge(std::size_t line) { return edges_[line].pop_front(); }

  private:
    static constexpr std::size_t kQueuedFrames = 4;  // per camera; a consumer further behind loses the oldest
    static constexpr std::size_t kQueuedEdges = 64;

    [[nodiscard]] const char* accept_frame_set(const WorldMessage& message);
    [[nodiscard]] const char* accept_edge(const WorldMessage& message);
    [[nodiscard]] const char* accept_time(std::int64_t time_us);
    void drop_holder(std::size_t camera, std::uint32_t slot);

    WorldHello hello_;
    std::int64_t time_us_ =
        0;  // the latest of all messages; edges may be told after the frame that they precede
    std::int64_t last_frame_us_ = -1;
    bool ended_ = false;
    bool tick_outstanding_ = false;
    std::uint32_t tick_sequence_ = 0;
    std::uint64_t dropped_frames_ = 0;
    std::array<bool, kMaxCameras> listening_{};
    std::array<Ring<QueuedFrame, kQueuedFrames>, kMaxCameras> queues_;
    std::array<std::uint8_t, kMaxWorldSlots> holders_{};  // bit c: camera c has the slot queued or borrowed
    std::array<bool, kMaxWorldSlots> ours_{};  // from its frame set until its kSlotFree is taken out
    SlotList freed_;
    std::array<bool, kWorldLineCount> lines_{};
    std::array<Ring<EdgeEvent, kQueuedEdges>, kWorldLineCount> edges_;
};

}  // namespace rig::sim
