// The daemon in real time: a thread per camera, one for the link, one for the recording, and the solver in
// the thread that called. What passes between them is the newest value, never a queue that could grow old.
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "firmware_host/daemon/app.hpp"
#include "firmware_host/daemon/latest_box.hpp"

namespace rig {

// Wakes one waiting thread; a raise() before the wait is not lost. The lock is held for an assignment only.
class Signal {
  public:
    void raise();
    // False when `patience_us` passed first.
    bool wait(std::int64_t patience_us);

  private:
    std::mutex mutex_;
    std::condition_variable raised_;
    bool is_raised_ = false;
};

class ThreadsExecutor {
  public:
    ThreadsExecutor(App& app, const std::atomic<bool>& stop) : app_(app), stop_(stop) {}
    [[nodiscard]] AppEnd run(App::Hook on_ready, App::Hook on_leave);

  private:
    struct Captured {
        std::vector<std::uint8_t> pixels;
        int width_px = 0;
        int height_px = 0;
        std::int64_t capture_us = 0;
    };
    // Pictures are copied out of the camera's buffers, so that a slow solve never starves a driver and a
    // camera is used by one thread only.
    struct Lane {
        LatestBox<Captured> box;
        const Captured* newest = nullptr;
        bool fresh = false;
        bool ever = false;
    };

    void start_threads();
    void capture(std::size_t camera);
    void serve_link();
    void record();
    void wait_for_go();
    void solve();
    [[nodiscard]] bool wait_for_pictures(std::int64_t deadline_us);
    [[nodiscard]] bool take_pictures();
    void tick_pictures();
    [[nodiscard]] bool is_expected(std::size_t camera) const;

    App& app_;
    const std::atomic<bool>& stop_;
    std::atomic<bool> go_{false};
    std::atomic<bool> leaving_{false};
    std::atomic<int> ready_{0};
    std::array<Lane, kMaxCameras> lanes_;
    LatestBox<TickOutput> outputs_;
    Signal pictures_;
    Signal output_ready_;
    std::vector<std::thread> threads_;
};

}  // namespace rig
