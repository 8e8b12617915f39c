// A camera behind the kernel's video driver.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/clock.hpp"
#include "hal/frame_source.hpp"
#include "hal/linux/v4l2/capture_device.hpp"
#include "hal/linux/v4l2/jpeg_grey.hpp"
#include "hal/linux/v4l2/video_nodes.hpp"

namespace rig {

// How a camera counts its gain.
struct GainScale {
    double unit_db = 0.0;  // decibels a step, from the control's lowest value on; or
    double unity = 0.0;    // the value that is a gain of 1, when the control is proportional to the gain
    [[nodiscard]] bool known() const { return unit_db > 0.0 || unity > 0.0; }
};

// A control that is set once at the start: trigger modes, white balance, whatever the board file names.
struct CameraControl {
    std::uint32_t id = 0;
    std::int32_t value = 0;
};

struct V4l2CameraConfig {
    CameraIdentity camera;
    int width_px = 640;
    int height_px = 480;
    double rate_hz = 60.0;
    std::optional<PixelLayout> layout;  // none: the first of GREY, Y16, YUYV, MJPEG that the camera gives
    GainScale gain;
    std::int32_t readout_us = 0;  // from the end of exposure to the stamp of drivers that stamp at the end
    std::vector<CameraControl> controls;
    DeviceTree tree;
};

class V4l2FrameSource final : public FrameSource {
  public:
    static constexpr int kBorrowed = 3;

    // `clock` is the kernel's monotonic one. Allocates; nothing after it does, a camera that is plugged in
    // again included.
    V4l2FrameSource(const Clock& clock, V4l2CameraConfig config);

    // kGone: no such camera. kIdentity: another camera is in its place. kRefused: the camera cannot do what
    // is asked of it. trouble() then says more.
    [[nodiscard]] Result<FrameFormat, FrameError> start() override;
    void stop() override;
    [[nodiscard]] Result<CameraFrame, FrameError> wait_frame(std::int64_t deadline_us) override;
    void release(std::uint32_t token) override;
    [[nodiscard]] int borrow_limit() const override { return kBorrowed; }
    [[nodiscard]] Result<void, FrameError> set_exposure_us(std::int32_t exposure_us) override;
    [[nodiscard]] Result<void, FrameError> set_gain_db(float gain_db) override;

    // One sentence on why the last start() failed, with the remedy; empty after one that succeeded.
    [[nodiscard]] std::string_view trouble() const { return trouble_.view(); }
    [[nodiscard]] const os::CaptureMode& mode() const { return mode_; }

  private:
    [[nodiscard]] Result<VideoNode, FrameError> find_node();
    [[nodiscard]] Result<void, FrameError> choose_mode(const VideoNode& node);
    [[nodiscard]] Result<void, FrameError> set_controls(const VideoNode& node);
    [[nodiscard]] bool fits(const os::CaptureMode& mode) const;
    [[nodiscard]] Result<CameraFrame, FrameError> frame_of(const os::FilledBuffer& buffer);
    [[nodiscard]] std::optional<FrameError> fault_of(const os::FilledBuffer& buffer) const;
    [[nodiscard]] Result<ImageView, FrameError> image_of(const os::FilledBuffer& buffer, std::size_t slot);
    [[nodiscard]] std::int64_t capture_us(const os::FilledBuffer& buffer) const;
    [[nodiscard]] FrameError fault_of_call(const os::SystemResult& result) const;
    template <class... Parts>
    FrameError explain(FrameError error, const char* format, Parts... parts);

    const Clock& clock_;
    V4l2CameraConfig config_;
    os::CaptureDevice device_;
    os::CaptureMode mode_;
    std::uint32_t generation_ = 0;  // of starts: tokens of an earlier one mean nothing
    bool running_ = false;
    std::int32_t exposure_us_ = 0;  // as last set; 0: not known
    std::array<bool, os::CaptureDevice::kBuffers> borrowed_{};
    std::vector<std::uint8_t> converted_;  // [buffer][height][width], for layouts other than GREY
    std::unique_ptr<JpegGrey> jpeg_;
    ShortText<240> trouble_;
};

}  // namespace rig
