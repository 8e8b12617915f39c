// Where camera frames come from: one source per camera.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/result.hpp"
#include "core/image/view.hpp"

namespace rig {

enum class FrameError : std::uint8_t {
    kTimeout,     // nothing before the deadline
    kGone,        // the camera is not there any more; close, then open again
    kIo,          // a transfer failed; the camera is still there
    kShort,       // a frame of the wrong length was discarded
    kFormat,      // a frame of the wrong size or format was discarded
    kDamaged,     // the driver marked a frame as damaged; it was discarded
    kCorrupt,     // a compressed frame could not be decoded whole; it was discarded
    kIdentity,    // another camera than the one that belongs here
    kNotStarted,  // start() has not succeeded
    kRefused,     // a mode or control that this source cannot set
    kEnded,       // the source is finite and is at its end (replay, simulated takes)
};

struct FrameFormat {
    int width_px = 0;
    int height_px = 0;
    double rate_hz = 0.0;
};

struct CameraFrame {
    ImageView image;              // borrowed until release()
    std::int64_t capture_us = 0;  // mid-exposure, on the Clock that belongs to the source
    std::uint32_t sequence = 0;   // counts captured frames, wraps; a gap is a lost frame
    std::uint32_t token = 0;      // for release()
};

// Contract. One thread uses a source. start() and stop() pair; stop() is idempotent and also ends a failed
// start. wait_frame() returns a frame captured after the previous one, or an error no later than deadline_us;
// it never blocks longer. At most borrow_limit() frames may be unreleased; frames are released in any order
// and each once. No call allocates after start().
class FrameSource {
  public:
    virtual ~FrameSource() = default;
    [[nodiscard]] virtual Result<FrameFormat, FrameError> start() = 0;
    virtual void stop() = 0;
    [[nodiscard]] virtual Result<CameraFrame, FrameError> wait_frame(std::int64_t deadline_us) = 0;
    virtual void release(std::uint32_t token) = 0;
    [[nodiscard]] virtual int borrow_limit() const = 0;
    // kRefused when out of the sensor's range; takes effect within 3 frames.
    [[nodiscard]] virtual Result<void, FrameError> set_exposure_us(std::int32_t exposure_us) = 0;
    [[nodiscard]] virtual Result<void, FrameError> set_gain_db(float gain_db) = 0;
};

}  // namespace rig
