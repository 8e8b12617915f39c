// Renders frames in order into a ring of slots, a few ahead of the one that is sent. Which bytes a frame has
// depends on its number and its controls alone, never on the number of threads or on timing.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "firmware_host/companion/world/truth_recorder.hpp"
#include "firmware_host/companion/world/world.hpp"

namespace rig::host {

class FramesAhead {
  public:
    // Image of camera c in slot s: images[(s * camera_count + c) * stride]. `rendered` is called from a
    // rendering thread after each frame. truth may be null.
    FramesAhead(const World& world, std::span<std::uint8_t> images, std::size_t stride,
                std::size_t slot_count, std::size_t threads, TruthRecorder* truth,
                std::function<void()> rendered);
    ~FramesAhead();
    FramesAhead(const FramesAhead&) = delete;
    FramesAhead& operator=(const FramesAhead&) = delete;

    // Frames below `end` may be rendered as soon as a slot is free.
    void allow(std::size_t end);
    // From frame `first` on; `first` must not be allowed yet when the result is to be reproducible.
    void control(std::size_t first, std::size_t camera, const CameraControl& control);
    [[nodiscard]] CameraControl control_of(std::size_t frame, std::size_t camera) const;

    // The slot of a rendered frame, now lent to the daemon; nothing while it is not ready.
    [[nodiscard]] std::optional<std::uint32_t> lend(std::size_t frame);
    // False when the slot is not lent.
    [[nodiscard]] bool take_back(std::uint32_t slot);
    // Gives a frame up, rendered or not. True when rendering had begun, false when no slot was free for it.
    bool give_up(std::size_t frame);

  private:
    enum class Use : std::uint8_t { kFree, kRendering, kReady, kLent };
    struct Slot {
        Use use = Use::kFree;
        std::size_t frame = 0;
        bool unwanted = false;
    };
    struct Change {
        std::size_t first;
        std::size_t camera;
        CameraControl control;
    };

    void work();
    [[nodiscard]] Slot* claim();
    void draw(WorldRenderer& renderer, std::size_t slot, std::size_t frame,
              std::span<const CameraControl> controls);
    [[nodiscard]] CameraControl control_locked(std::size_t frame, std::size_t camera) const;

    const World& world_;
    std::span<std::uint8_t> images_;
    std::size_t stride_;
    TruthRecorder* truth_;
    std::function<void()> rendered_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::vector<Slot> slots_;
    std::vector<Change> changes_;
    std::size_t next_ = 0;
    std::size_t allowed_ = 0;
    bool ending_ = false;
    std::vector<std::jthread> threads_;  // last: they use all of the above
};

}  // namespace rig::host
