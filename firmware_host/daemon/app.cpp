#include "firmware_host/daemon/app.hpp"

#include <algorithm>

namespace rig {

namespace {

constexpr std::int64_t kLinkPoll_us = 200;
constexpr std::int64_t kFirstFrame_us =
    10'000'000;  // the clock of a simulation may start well before its first frame
constexpr int kEdgesPerTick = 16;
constexpr int kCatchUpFrames = 8;

TickSolverParts solver_parts(const AppParts& parts, const AppConfig& config) {
    return {parts.pipeline, parts.wall, parts.log, parts.pack, config.rate_hz};
}

}  // namespace

FaultMap assemble(std::span<const TickPicture> pictures, std::int64_t now_us, std::int64_t period_us,
                  FrameSet& frames) {
    FaultMap faults = 0;
    bool any = false;
    std::int64_t newest_us = 0;
    for (const TickPicture& picture : pictures) {
        if (picture.image.empty()) continue;
        newest_us = any ? std::max(newest_us, picture.capture_us) : picture.capture_us;
        any = true;
    }
    frames = FrameSet{};
    frames.camera_count = static_cast<std::uint8_t>(pictures.size());
    frames.capture_us = any ? newest_us : now_us;
    for (std::size_t c = 0; c < pictures.size(); ++c) {
        const TickPicture& picture = pictures[c];
        const bool in_step = !picture.image.empty() && 2 * (newest_us - picture.capture_us) <= period_us;
        if (!picture.image.empty() && !in_step) faults |= fault_bit(Fault::kCameraSync);
        frames.images[c] = in_step ? picture.image : ImageView{};
        const bool gone_quiet = picture.status == CameraStatus::kGood && !in_step;
        frames.status[c] = in_step      ? CameraStatus::kGood
                           : gone_quiet ? CameraStatus::kMissing
                                        : picture.status;
    }
    return faults;
}

App::App(const AppParts& parts, const AppConfig& config)
    : parts_(parts),
      config_(config),
      solver_(solver_parts(parts, config)),
      port_(parts.link, parts.clock, parts.wall, config.vitals),
      control_(port_, solver_, parts.clock, parts.wall, config.identity) {
    RIG_CHECK(parts_.cameras.size() <= kMaxCameras);
    for (FrameSource* camera : parts_.cameras) {
        feeds_.push_back(std::make_unique<CameraFeed>(*camera, parts_.clock, config_.feed));
    }
    for (ExposureControl& each : exposures_) {
        if (config_.exposure) RIG_CHECK(each.configure(*config_.exposure).has_value());
    }
    started_us_ = parts_.clock.now_us();
    port_.adopt();
}

void App::open_cameras() {
    for (const auto& feed : feeds_) static_cast<void>(feed->open());
}

bool App::is_over() const {
    if (parts_.pace.status() != Pace::Status::kRunning) return true;
    return !feeds_.empty() &&
           std::all_of(feeds_.begin(), feeds_.end(), [](const auto& feed) { return feed->ended(); });
}

void App::wait_for_host(const std::atomic<bool>& stop) {
    const std::int64_t deadline_us = parts_.wall.now_us() + config_.wait_for_host_us;
    const auto waiting = [&] { return config_.wait_for_host_us > 0 && parts_.wall.now_us() < deadline_us; };
    while (!stop && waiting() && !(control_.has_owner() && control_.is_streaming())) {
        control_.service();
        port_.pump_out();
        parts_.wall.sleep_until_us(parts_.wall.now_us() + kLinkPoll_us);
    }
}

FaultMap App::take_feed_faults() {
    FaultMap faults = 0;
    for (const auto& feed : feeds_) {
        faults |= feed->take_faults();
        // Also of a camera that the pack does not know, and without a pack.
        if (feed->status() == CameraStatus::kGone) faults |= fault_bit(Fault::kCameraGone);
    }
    return faults;
}

void App::tick(const FrameSet& frames, FaultMap faults) {
    poll_button();
    solver_.tick(frames, faults | exposure_faults_, output_);
    expose(frames);
    output_.health.uptime_us = std::max<std::int64_t>(parts_.clock.now_us() - started_us_, 0);
    last_tick_us_ = parts_.clock.now_us();
    show_state();
    parts_.watchdog.feed();
}

// What each camera's detector has just measured leads that camera. In SAFE nothing is measured.
void App::expose(const FrameSet& frames) {
    exposure_faults_ = 0;
    if (!config_.exposure || parts_.pack == nullptr) return;
    for (std::size_t c = 0; c < feeds_.size(); ++c) {
        if (!has_picture(frames.status[c]) || frames.images[c].empty()) continue;
        const DetectorReport& seen = parts_.pipeline.detector_report(c);
        const LightReading reading{seen.brightest_level, seen.faintest_contrast,
                                   static_cast<std::uint16_t>(parts_.pipeline.observations(c).size()),
                                   seen.mean_luma, seen.saturated_fraction};
        const ExposureProposal proposal = exposures_[c].step(reading);
        if (proposal.changed) feeds_[c]->request_exposure(proposal.exposure_us, proposal.gain_db);
        exposure_faults_ |= proposal.faults;
    }
}

void App::poll_button() {
    if (parts_.neutral_button == nullptr) return;
    for (int i = 0; i < kEdgesPerTick; ++i) {
        const auto edge = parts_.neutral_button->wait_edge(parts_.clock.now_us());
        if (!edge) return;
        if (edge->rising) solver_.request_reset();
    }
}

void App::show_state() {
    const bool live = output_.state.state == TrackingState::kLive;
    if (parts_.live_led == nullptr || live == led_on_) return;
    if (parts_.live_led->set(live)) led_on_ = live;
}

// False when the run is over and there is nothing to tick for.
bool App::gather(std::array<std::optional<CameraFrame>, kMaxCameras>& frames) {
    const std::int64_t now_us = parts_.clock.now_us();
    const std::int64_t deadline_us = last_tick_us_ < 0
                                         ? now_us + kFirstFrame_us
                                         : std::max(now_us + 1, last_tick_us_ + period_us() * 3 / 2);
    bool any = false;
    for (std::size_t c = 0; c < feeds_.size(); ++c) {
        frames[c] = feeds_[c]->take(deadline_us);
        any = any || frames[c].has_value();
    }
    if (any) {
        catch_up(frames);
        return true;
    }
    if (is_over()) return false;
    // Nobody has waited when every camera is gone: time has to go on all the same.
    if (parts_.clock.now_us() < deadline_us) parts_.clock.sleep_until_us(deadline_us);
    return !is_over();
}

// A camera that came back may be a frame behind the others, and would stay so.
void App::catch_up(std::array<std::optional<CameraFrame>, kMaxCameras>& frames) {
    std::int64_t newest_us = 0;
    for (const auto& frame : frames) newest_us = frame ? std::max(newest_us, frame->capture_us) : newest_us;
    for (std::size_t c = 0; c < feeds_.size(); ++c) {
        for (int i = 0;
             i < kCatchUpFrames && frames[c] && 2 * (newest_us - frames[c]->capture_us) > period_us(); ++i) {
            feeds_[c]->release(*frames[c]);
            frames[c] = feeds_[c]->take(parts_.clock.now_us());
        }
    }
}

AppEnd App::run_lockstep(const std::atomic<bool>& stop, Hook on_ready, Hook on_leave) {
    parts_.watchdog.arm();
    on_ready();
    wait_for_host(stop);
    std::array<std::optional<CameraFrame>, kMaxCameras> taken;
    std::array<TickPicture, kMaxCameras> pictures;
    FrameSet frames;
    while (!stop && gather(taken)) {
        if (stop) break;
        for (std::size_t c = 0; c < feeds_.size(); ++c) {
            pictures[c] = TickPicture{};
            pictures[c].status = feeds_[c]->status();
            if (!taken[c]) continue;
            pictures[c].image = taken[c]->image;
            pictures[c].capture_us = taken[c]->capture_us;
        }
        const FaultMap sync =
            assemble(std::span(pictures).first(feeds_.size()), parts_.clock.now_us(), period_us(), frames);
        tick(frames, sync | take_feed_faults());
        for (std::size_t c = 0; c < feeds_.size(); ++c) {
            if (taken[c]) feeds_[c]->release(*taken[c]);
            taken[c].reset();
        }
        port_.offer(output_);
        serve_link_until_drained(stop);
        if (parts_.log != nullptr) static_cast<void>(parts_.log->drain());
        parts_.pace.tick_done();
    }
    on_leave();
    for (std::size_t c = 0; c < feeds_.size(); ++c) {
        if (taken[c]) feeds_[c]->release(*taken[c]);
    }
    parts_.watchdog.disarm();
    say_goodbye();
    if (stop) return AppEnd::kStopped;
    return parts_.pace.status() == Pace::Status::kGone ? AppEnd::kWorldGone : AppEnd::kWorldEnded;
}

// A slow host costs time and never a frame. A host that takes nothing for the whole patience costs it once:
// from then on the simulation does not wait until bytes are taken again.
void App::serve_link_until_drained(const std::atomic<bool>& stop) {
    std::uint64_t taken = port_.bytes_taken();
    std::int64_t moved_us = parts_.wall.now_us();
    while (!stop) {
        control_.service();
        port_.pump_out();
        if (port_.bytes_taken() != taken) {
            taken = port_.bytes_taken();
            moved_us = parts_.wall.now_us();
            host_reads_ = true;
        }
        if (port_.drained()) return;
        if (!host_reads_) return;
        if (parts_.wall.now_us() - moved_us > config_.host_patience_us) {
            host_reads_ = false;
            return;
        }
        parts_.wall.sleep_until_us(parts_.wall.now_us() + kLinkPoll_us);
    }
}

// The last state again would be a lie about time; its status is the truth about the run.
void App::say_goodbye() {
    if (control_.is_streaming()) port_.request_status();
    const std::int64_t deadline_us = parts_.wall.now_us() + config_.farewell_us;
    const auto flush = [&] {
        while (!port_.drained() && parts_.wall.now_us() < deadline_us) {
            port_.pump_out();
            if (!port_.drained()) parts_.wall.sleep_until_us(parts_.wall.now_us() + kLinkPoll_us);
        }
    };
    flush();
    control_.leave();
    flush();
    for (const auto& feed : feeds_) feed->close();
    if (parts_.log != nullptr) static_cast<void>(parts_.log->drain());
    port_.close();
}

}  // namespace rig
