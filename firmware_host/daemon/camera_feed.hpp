// One camera as the tick loop wants it: opened again when it comes back, without frames that are late,
// repeated, frozen or broken. On the interfaces only. Not for: what the pictures show.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>

#include "core/base/face_state.hpp"
#include "core/base/faults.hpp"
#include "hal/clock.hpp"
#include "hal/frame_source.hpp"

namespace rig {

struct CameraFeedConfig {
    double rate_hz = 60.0;
    int frozen_frames = 3;                  // equal pictures in a row that count as frozen (F08); 0: never
    std::int64_t io_window_us = 1'000'000;  // three transfer errors within it restart the camera (F03)
};

class CameraFeed {
  public:
    CameraFeed(FrameSource& source, const Clock& clock, CameraFeedConfig config)
        : source_(source), clock_(clock), config_(config) {}

    // Starts the camera. A camera that is not there is tried again later, by take(): after 0.25, 0.5, 1 s,
    // then each 2 s.
    [[nodiscard]] Result<FrameFormat, FrameError> open();
    void close();

    // The next usable frame, or none by the deadline; status() then says why. Release it before the next
    // call.
    [[nodiscard]] std::optional<CameraFrame> take(std::int64_t deadline_us);
    void release(const CameraFrame& frame) { source_.release(frame.token); }

    // Any thread: before the next frame is waited for, the camera gets these. The newest request counts; a
    // camera that is opened again gets it again.
    void request_exposure(std::int32_t exposure_us, float gain_db);
    // How often the camera refused a request.
    [[nodiscard]] std::uint32_t refusals() const { return refusals_.load(std::memory_order_relaxed); }

    // Any thread.
    [[nodiscard]] CameraStatus status() const { return status_.load(std::memory_order_relaxed); }
    [[nodiscard]] bool ended() const { return ended_.load(std::memory_order_relaxed); }
    // Faults met since the last call.
    [[nodiscard]] FaultMap take_faults() { return faults_.exchange(0, std::memory_order_relaxed); }

  private:
    enum class Verdict : std::uint8_t { kUse, kSkip };

    [[nodiscard]] bool is_running();
    [[nodiscard]] bool go_on_after(FrameError error);
    [[nodiscard]] Verdict judge(const CameraFrame& frame);
    [[nodiscard]] bool is_frozen(const CameraFrame& frame);
    void lose();
    void note_io_error();
    void pass_exposure_on();
    void raise(Fault fault) { faults_.fetch_or(fault_bit(fault), std::memory_order_relaxed); }
    void set_status(CameraStatus status) { status_.store(status, std::memory_order_relaxed); }

    FrameSource& source_;
    const Clock& clock_;
    CameraFeedConfig config_;
    std::atomic<CameraStatus> status_{CameraStatus::kMissing};
    std::atomic<bool> ended_{false};
    std::atomic<FaultMap> faults_{0};
    std::atomic<std::uint64_t> wanted_exposure_{0};  // microseconds and the bits of the gain; 0: none yet
    std::atomic<std::uint32_t> refusals_{0};
    std::uint64_t passed_exposure_ = 0;
    bool running_ = false;
    bool any_frame_ = false;
    bool counts_on_ = false;  // last_sequence_ is of this start
    std::int64_t last_capture_us_ = 0;
    std::uint32_t last_sequence_ = 0;
    std::int64_t last_usable_us_ = 0;
    std::int64_t retry_us_ = 0;
    std::int64_t back_off_us_ = 0;
    std::int64_t io_since_us_ = 0;
    int io_errors_ = 0;
    std::uint64_t picture_hash_ = 0;
    int equal_pictures_ = 0;     // in a row, the first one not counted
    int changing_pictures_ = 0;  // since it was frozen
    bool frozen_ = false;
};

}  // namespace rig
