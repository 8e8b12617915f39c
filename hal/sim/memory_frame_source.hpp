// Cameras whose pictures come from memory: a recorded sequence, or a painter called for each frame.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "hal/clock.hpp"
#include "hal/frame_source.hpp"

namespace rig::sim {

struct FramePacing {
    double rate_hz = 60.0;
    std::int64_t delivery_us = 0;   // from mid-exposure to delivery
    std::uint32_t frame_total = 0;  // then kEnded; 0: endless
    bool drops_when_late =
        true;  // as a sensor does: a consumer behind by more than one frame loses the old ones
};

// Frame i has its mid-exposure at the first start() + (i + 1) / rate on the clock given; what happens in
// front of a camera goes on while it is stopped.
class PacedFrameSource : public FrameSource {
  public:
    PacedFrameSource(Clock& clock, int width_px, int height_px, FramePacing pacing);
    [[nodiscard]] Result<FrameFormat, FrameError> start() override;
    void stop() override;
    [[nodiscard]] Result<CameraFrame, FrameError> wait_frame(std::int64_t deadline_us) override;
    void release(std::uint32_t token) override;
    [[nodiscard]] int borrow_limit() const override { return kSlots; }
    [[nodiscard]] Result<void, FrameError> set_exposure_us(std::int32_t exposure_us) override;
    [[nodiscard]] Result<void, FrameError> set_gain_db(float gain_db) override;

  protected:
    static constexpr int kSlots = 3;
    // Pixels of the frame, rows without gaps, valid until `slot` is used again.
    [[nodiscard]] virtual const std::uint8_t* pixels_of(std::uint32_t frame, std::size_t slot) = 0;
    [[nodiscard]] std::size_t pixel_count() const;

  private:
    [[nodiscard]] std::int64_t capture_of(std::uint32_t frame) const;
    void skip_missed(std::int64_t now_us);

    Clock& clock_;
    FrameFormat format_;
    FramePacing pacing_;
    std::int64_t started_us_ = 0;
    std::uint32_t next_frame_ = 0;
    bool ever_started_ = false;
    bool running_ = false;
    std::array<bool, kSlots> borrowed_{};
};

// Delivers the images in order, the first again after the last; pacing.frame_total ends it.
class ReplayFrameSource final : public PacedFrameSource {
  public:
    // Every image has width_px * height_px bytes; at least one image.
    ReplayFrameSource(Clock& clock, int width_px, int height_px,
                      std::vector<std::vector<std::uint8_t>> images, FramePacing pacing);

  private:
    [[nodiscard]] const std::uint8_t* pixels_of(std::uint32_t frame, std::size_t slot) override;
    std::vector<std::vector<std::uint8_t>> images_;
};

using FramePainter = std::function<void(std::uint32_t frame, std::span<std::uint8_t> pixels)>;

class SyntheticFrameSource final : public PacedFrameSource {
  public:
    SyntheticFrameSource(Clock& clock, int width_px, int height_px, FramePainter painter, FramePacing pacing);

  private:
    [[nodiscard]] const std::uint8_t* pixels_of(std::uint32_t frame, std::size_t slot) override;
    FramePainter painter_;
    std::array<std::vector<std::uint8_t>, kSlots> slots_;
};

}  // namespace rig::sim
