// Any camera, with the faults of a plan.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "hal/clock.hpp"
#include "hal/frame_source.hpp"
#include "hal/sim/fault_plan.hpp"

namespace rig::sim {

// Times of the plan count from the clock's time at construction; faults of pictures go by their capture time,
// so that a plan means the same frames however fast the simulation runs. kCameraLate and kCameraReorder
// deliver out of time order on purpose: that is the fault.
class FaultyFrameSource final : public FrameSource {
  public:
    FaultyFrameSource(FrameSource& inner, Clock& clock, const FaultPlan& plan, std::uint8_t target);
    [[nodiscard]] Result<FrameFormat, FrameError> start() override;
    void stop() override;
    [[nodiscard]] Result<CameraFrame, FrameError> wait_frame(std::int64_t deadline_us) override;
    void release(std::uint32_t token) override;
    [[nodiscard]] int borrow_limit() const override;
    [[nodiscard]] Result<void, FrameError> set_exposure_us(std::int32_t exposure_us) override;
    [[nodiscard]] Result<void, FrameError> set_gain_db(float gain_db) override;

  private:
    enum class KeptBack : std::uint8_t {
        kNothing,
        kUntilTime,   // kept_back_ goes out at kept_until_us_
        kUntilNewer,  // kept_back_ goes out after the frame that follows it
        kNext,        // kept_back_ goes out now
    };
    struct OwnImage {
        std::vector<std::uint8_t> pixels;
        bool borrowed = false;
    };
    static constexpr std::uint32_t kOwnToken = 0x8000'0000U;  // bit set: the image is one of own_images_

    [[nodiscard]] const FaultEvent* active(FaultKind what, std::int64_t time_us) const;
    [[nodiscard]] std::optional<FrameError> discard_by_plan(const CameraFrame& frame);
    [[nodiscard]] bool keep_back(const CameraFrame& frame);
    [[nodiscard]] bool kept_frame_is_due(std::int64_t deadline_us);
    [[nodiscard]] CameraFrame repainted(CameraFrame frame);
    [[nodiscard]] CameraFrame copied(const CameraFrame& frame);

    FrameSource& inner_;
    Clock& clock_;
    const FaultPlan& plan_;
    std::uint8_t target_;
    std::int64_t started_us_;
    std::vector<OwnImage> own_images_;
    std::vector<std::uint8_t> frozen_pixels_;
    const FaultEvent* frozen_by_ = nullptr;
    CameraFrame kept_back_;
    KeptBack kept_ = KeptBack::kNothing;
    std::int64_t kept_until_us_ = 0;
    bool running_ = false;
    bool gone_ = false;
};

}  // namespace rig::sim
