// The daemon between its wires: cameras, solver, link and host put together, on the interfaces of hal only,
// so that it runs in a test as it runs on the rig. Not for: which backend stands behind an interface
// (wiring.hpp).
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/expose/exposure_control.hpp"
#include "firmware_host/daemon/camera_feed.hpp"
#include "firmware_host/daemon/control.hpp"
#include "firmware_host/daemon/link_port.hpp"
#include "firmware_host/daemon/tick_solver.hpp"
#include "hal/byte_link.hpp"
#include "hal/clock.hpp"
#include "hal/frame_source.hpp"
#include "hal/gpio_line.hpp"
#include "hal/watchdog.hpp"

namespace rig {

// What stands behind the cameras, when it is one thing: a simulated world waits for leave to go on, ends, or
// goes away.
class Pace {
  public:
    enum class Status : std::uint8_t { kRunning, kEnded, kGone };
    virtual ~Pace() = default;
    virtual void tick_done() {}
    [[nodiscard]] virtual Status status() const { return Status::kRunning; }
};

struct AppParts {
    Clock& clock;  // the rig's time; in lockstep it moves only between ticks
    Clock& wall;   // the time of the machine; the same object as `clock` on a real rig
    std::vector<FrameSource*> cameras;
    ByteLink& link;
    Watchdog& watchdog;
    Pace& pace;
    GpioLine* neutral_button = nullptr;  // may be none
    GpioLine* live_led = nullptr;        // may be none
    Pipeline& pipeline;                  // configured, or in SAFE
    const SolvePack* pack = nullptr;
    ObservationLogWriter* log = nullptr;
};

struct AppConfig {
    double rate_hz = 60.0;
    CameraFeedConfig feed;
    std::optional<ExposureConfig> exposure;  // none: cameras keep the exposure they have
    BoardIdentity identity;
    Vitals vitals;
    std::int64_t host_patience_us =
        2'000'000;  // lockstep: how long a host that reads nothing may hold up the simulation
    std::int64_t wait_for_host_us = 0;     // before the first tick, for a host to start a stream
    std::int64_t farewell_us = 1'000'000;  // at the end, for the last frames to leave
};

enum class AppEnd : std::uint8_t { kStopped, kWorldEnded, kWorldGone };

class App {
  public:
    App(const AppParts& parts, const AppConfig& config);

    // The link is open already. A camera that is not there is no failure: it is tried again.
    void open_cameras();

    // Until `stop` or until the world ends. `on_ready` is called once, when everything has been started and
    // nothing will be allocated any more; `on_leave` when the last tick is done.
    using Hook = void (*)();
    [[nodiscard]] AppEnd run_lockstep(const std::atomic<bool>& stop, Hook on_ready, Hook on_leave);
    [[nodiscard]] AppEnd run_threads(const std::atomic<bool>& stop, Hook on_ready, Hook on_leave);

    [[nodiscard]] const StreamDigest& digest() const { return solver_.digest(); }
    [[nodiscard]] Health health() const { return port_.health(solver_.health()); }

  private:
    friend class ThreadsExecutor;

    void wait_for_host(const std::atomic<bool>& stop);
    [[nodiscard]] bool gather(std::array<std::optional<CameraFrame>, kMaxCameras>& frames);
    void catch_up(std::array<std::optional<CameraFrame>, kMaxCameras>& frames);
    void tick(const FrameSet& frames, FaultMap faults);
    void expose(const FrameSet& frames);
    [[nodiscard]] FaultMap take_feed_faults();
    void serve_link_until_drained(const std::atomic<bool>& stop);
    void poll_button();
    void show_state();
    void say_goodbye();
    [[nodiscard]] bool is_over() const;
    [[nodiscard]] std::int64_t period_us() const { return static_cast<std::int64_t>(1e6 / config_.rate_hz); }

    AppParts parts_;
    AppConfig config_;
    std::vector<std::unique_ptr<CameraFeed>> feeds_;
    std::array<ExposureControl, kMaxCameras> exposures_;
    FaultMap exposure_faults_ = 0;  // of the last tick
    TickSolver solver_;
    LinkPort port_;
    Control control_;
    TickOutput output_;
    std::int64_t last_tick_us_ = -1;
    std::int64_t started_us_ = 0;
    bool host_reads_ = true;
    bool led_on_ = false;
};

// Puts the newest pictures into one set. A picture more than half a period older than the newest is left out
// (F12).
struct TickPicture {
    ImageView image;
    std::int64_t capture_us = 0;
    CameraStatus status = CameraStatus::kMissing;
};
[[nodiscard]] FaultMap assemble(std::span<const TickPicture> pictures, std::int64_t now_us,
                                std::int64_t period_us, FrameSet& frames);

}  // namespace rig
