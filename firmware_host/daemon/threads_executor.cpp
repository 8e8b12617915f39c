#include "firmware_host/daemon/threads_executor.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>

namespace rig {

namespace {

constexpr std::int64_t kCaptureWait_us = 40'000;
constexpr std::int64_t kClosedCameraNap_us = 20'000;
constexpr std::int64_t kLinkBusy_us = 500;    // while bytes wait that the link did not take
constexpr std::int64_t kLinkIdle_us = 2'000;  // how late a command may be noticed
constexpr std::int64_t kRecorderNap_us = 100'000;

}  // namespace

void Signal::raise() {
    {
        const std::scoped_lock lock(mutex_);
        is_raised_ = true;
    }
    raised_.notify_one();
}

bool Signal::wait(std::int64_t patience_us) {
    std::unique_lock lock(mutex_);
    const auto until =
        std::chrono::steady_clock::now() + std::chrono::microseconds(std::max<std::int64_t>(patience_us, 0));
    const bool raised = raised_.wait_until(lock, until, [this] { return is_raised_; });
    is_raised_ = false;
    return raised;
}

AppEnd App::run_threads(const std::atomic<bool>& stop, Hook on_ready, Hook on_leave) {
    const auto executor = std::make_unique<ThreadsExecutor>(*this, stop);
    return executor->run(on_ready, on_leave);
}

AppEnd ThreadsExecutor::run(App::Hook on_ready, App::Hook on_leave) {
    app_.wait_for_host(stop_);
    start_threads();
    app_.parts_.watchdog.arm();
    on_ready();
    go_ = true;
    go_.notify_all();
    solve();
    on_leave();
    app_.parts_.watchdog.disarm();
    leaving_ = true;
    leaving_.notify_all();
    output_ready_.raise();
    for (std::thread& thread : threads_) thread.join();
    app_.say_goodbye();
    if (stop_) return AppEnd::kStopped;
    return app_.parts_.pace.status() == Pace::Status::kGone ? AppEnd::kWorldGone : AppEnd::kWorldEnded;
}

void ThreadsExecutor::start_threads() {
    const std::size_t cameras = app_.feeds_.size();
    for (std::size_t c = 0; c < cameras; ++c) {
        for (Captured& slot : lanes_[c].box.values()) slot.pixels.resize(kMaxImageWidth * kMaxImageHeight);
        threads_.emplace_back([this, c] { capture(c); });
    }
    threads_.emplace_back([this] { serve_link(); });
    if (app_.parts_.log != nullptr) threads_.emplace_back([this] { record(); });
    while (ready_ < static_cast<int>(threads_.size())) std::this_thread::yield();
}

void ThreadsExecutor::wait_for_go() {
    ++ready_;
    go_.wait(false);
}

void ThreadsExecutor::capture(std::size_t camera) {
    wait_for_go();
    CameraFeed& feed = *app_.feeds_[camera];
    Clock& clock = app_.parts_.clock;
    while (!leaving_ && !feed.ended()) {
        const auto frame = feed.take(clock.now_us() + kCaptureWait_us);
        if (!frame) {
            if (feed.status() == CameraStatus::kGone)
                clock.sleep_until_us(clock.now_us() + kClosedCameraNap_us);
            continue;
        }
        Captured& copy = lanes_[camera].box.back();
        copy.width_px = frame->image.width_px;
        copy.height_px = frame->image.height_px;
        copy.capture_us = frame->capture_us;
        const auto width = static_cast<std::size_t>(copy.width_px);
        const bool fits = width * static_cast<std::size_t>(copy.height_px) <= copy.pixels.size();
        for (int y = 0; fits && y < copy.height_px; ++y) {
            std::memcpy(copy.pixels.data() + static_cast<std::size_t>(y) * width, frame->image.row(y), width);
        }
        feed.release(*frame);
        if (!fits) continue;
        static_cast<void>(lanes_[camera].box.publish());
        pictures_.raise();
    }
    pictures_.raise();
    leaving_.wait(false);  // the end of a thread gives memory back: not before the heap is unsealed
}

void ThreadsExecutor::serve_link() {
    wait_for_go();
    LinkPort& port = app_.port_;
    while (!leaving_) {
        if (const TickOutput* output = outputs_.take()) port.offer(*output);
        app_.control_.service();
        port.pump_out();
        output_ready_.wait(port.drained() ? kLinkIdle_us : kLinkBusy_us);
    }
    if (const TickOutput* output = outputs_.take()) port.offer(*output);
}

void ThreadsExecutor::record() {
    wait_for_go();
    Clock& wall = app_.parts_.wall;
    while (!leaving_) {
        static_cast<void>(app_.parts_.log->drain());
        wall.sleep_until_us(wall.now_us() + kRecorderNap_us);
    }
}

bool ThreadsExecutor::is_expected(std::size_t camera) const {
    const CameraStatus status = app_.feeds_[camera]->status();
    return status == CameraStatus::kGood || (status == CameraStatus::kMissing && !lanes_[camera].ever);
}

// True when every camera that delivers has a new picture of the same moment.
bool ThreadsExecutor::take_pictures() {
    std::int64_t newest_us = 0;
    for (std::size_t c = 0; c < app_.feeds_.size(); ++c) {
        Lane& lane = lanes_[c];
        if (const Captured* newer = lane.box.take()) {
            lane.newest = newer;
            lane.fresh = lane.ever = true;
        }
        if (lane.fresh) newest_us = std::max(newest_us, lane.newest->capture_us);
    }
    bool all = true;
    for (std::size_t c = 0; c < app_.feeds_.size(); ++c) {
        Lane& lane = lanes_[c];
        // A picture of the moment before does not make a pair with this one.
        if (lane.fresh && 2 * (newest_us - lane.newest->capture_us) > app_.period_us()) lane.fresh = false;
        all = all && (lane.fresh || !is_expected(c));
    }
    return all;
}

// False when the run is over.
bool ThreadsExecutor::wait_for_pictures(std::int64_t deadline_us) {
    Clock& clock = app_.parts_.clock;
    std::int64_t first_us = -1;
    while (!stop_) {
        const bool all = take_pictures();
        const bool any =
            std::any_of(lanes_.begin(), lanes_.end(), [](const Lane& lane) { return lane.fresh; });
        const std::int64_t now_us = clock.now_us();
        if (any && first_us < 0) first_us = now_us;
        if (any && (all || now_us - first_us > app_.period_us() / 2)) return true;
        if (!any && app_.is_over()) return false;
        if (now_us >= deadline_us) return true;
        const std::int64_t until_us =
            any ? std::min(deadline_us, first_us + app_.period_us() / 2 + 1) : deadline_us;
        pictures_.wait(until_us - now_us);
    }
    return false;
}

void ThreadsExecutor::tick_pictures() {
    std::array<TickPicture, kMaxCameras> pictures;
    for (std::size_t c = 0; c < app_.feeds_.size(); ++c) {
        Lane& lane = lanes_[c];
        pictures[c].status = app_.feeds_[c]->status();
        if (!lane.fresh) continue;
        pictures[c].image = {lane.newest->pixels.data(), lane.newest->width_px, lane.newest->height_px,
                             lane.newest->width_px};
        pictures[c].capture_us = lane.newest->capture_us;
        lane.fresh = false;
    }
    FrameSet frames;
    const std::int64_t now_us = app_.parts_.clock.now_us();
    const FaultMap sync =
        assemble(std::span(pictures).first(app_.feeds_.size()), now_us, app_.period_us(), frames);
    app_.tick(frames, sync | app_.take_feed_faults());
    outputs_.back() = app_.output_;
    if (outputs_.publish()) app_.port_.note_replaced();
    output_ready_.raise();
    app_.parts_.pace.tick_done();
}

// One tick a period, pictures or not; with pictures they set the beat.
void ThreadsExecutor::solve() {
    std::int64_t deadline_us = app_.parts_.clock.now_us() + 2 * app_.period_us();
    while (wait_for_pictures(deadline_us)) {
        const bool any =
            std::any_of(lanes_.begin(), lanes_.end(), [](const Lane& lane) { return lane.fresh; });
        const std::int64_t now_us = app_.parts_.clock.now_us();
        tick_pictures();
        deadline_us =
            any ? now_us + app_.period_us() * 3 / 2 : std::max(deadline_us + app_.period_us(), now_us);
    }
}

}  // namespace rig
