// One opened V4L2 capture node with its mapped buffers. Every answer of the driver is checked, none is
// trusted. No heap. Not for: which node, what a frame shows (v4l2_frame_source.hpp).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "hal/linux/descriptor.hpp"
#include "hal/linux/system_call.hpp"
#include "hal/linux/v4l2/grey_conversion.hpp"

namespace rig::os {

struct CaptureMode {
    PixelLayout layout = PixelLayout::kGrey;
    int width_px = 0;
    int height_px = 0;
    double rate_hz = 0.0;         // 0: the driver does not tell
    std::uint32_t row_bytes = 0;  // 0 for JPEG
    std::uint32_t most_frame_bytes = 0;
};

struct ControlRange {
    std::int32_t lowest = 0;
    std::int32_t highest = 0;
    std::int32_t step = 1;
};

struct FilledBuffer {
    std::uint32_t index = 0;
    std::span<const std::uint8_t> bytes;  // as many as the driver says are used, never beyond the mapping
    bool over_long = false;               // it said more than fit
    bool damaged = false;                 // V4L2_BUF_FLAG_ERROR
    std::uint32_t sequence = 0;
    std::optional<std::int64_t> stamp_us;  // CLOCK_MONOTONIC; none when the driver stamps by another clock
    bool stamp_at_start = false;           // of the exposure; otherwise at the end of the transfer
};

// The node has gone, and with it everything that was opened, mapped or queued on it.
[[nodiscard]] bool is_gone(const SystemResult& result);

class CaptureDevice {
  public:
    static constexpr std::uint32_t kBuffers = 6;

    CaptureDevice() = default;
    ~CaptureDevice() { close(); }
    CaptureDevice(const CaptureDevice&) = delete;
    CaptureDevice& operator=(const CaptureDevice&) = delete;

    // kFailed also for nodes that do not capture or do not stream.
    [[nodiscard]] SystemResult open(const char* path);
    // Ends the stream, unmaps and lets go of every descriptor, whatever state it is in.
    void close();
    [[nodiscard]] bool is_open() const { return node_.is_open(); }

    // Asks for a mode and returns what the driver made of it, which may be another one; none when it fails.
    [[nodiscard]] std::optional<CaptureMode> ask_for(PixelLayout layout, int width_px, int height_px,
                                                     double rate_hz);
    // Maps the buffers, hands all of them to the driver and starts.
    [[nodiscard]] SystemResult start();
    // Waits until `timeout_ms`: done with value 0 when nothing came, 1 when something is there to be taken.
    [[nodiscard]] SystemResult wait(int timeout_ms);
    // Tolerated: nothing is there after all.
    [[nodiscard]] SystemResult take(FilledBuffer& buffer);
    [[nodiscard]] SystemResult give_back(std::uint32_t index);

    // None when the device lacks the control or has it switched off.
    [[nodiscard]] std::optional<ControlRange> range_of(std::uint32_t control);
    [[nodiscard]] SystemResult set_control(std::uint32_t control, std::int32_t value);

  private:
    struct Mapping {
        void* address = nullptr;
        std::size_t bytes = 0;
    };

    [[nodiscard]] SystemResult request(std::uint32_t count);
    [[nodiscard]] SystemResult map(std::uint32_t index);
    [[nodiscard]] SystemResult stream(bool on);

    Descriptor node_;
    std::array<Mapping, kBuffers> mappings_{};
    std::uint32_t buffer_count_ = 0;
    bool streaming_ = false;
};

}  // namespace rig::os
