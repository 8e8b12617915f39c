// The daemon's app on backends in memory, in simulated time, with a host that lives in the moments in which
// the daemon waits for it: one thread, the same run each time.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "core/wire/frame.hpp"
#include "core/wire/health.hpp"
#include "core/wire/session_messages.hpp"
#include "core/wire/state_messages.hpp"
#include "firmware_host/daemon/app.hpp"
#include "hal/sim/faulty_frame_source.hpp"
#include "hal/sim/faulty_link.hpp"
#include "hal/sim/loopback_link.hpp"
#include "hal/sim/manual_clock.hpp"
#include "hal/sim/memory_frame_source.hpp"
#include "hal/sim/memory_line.hpp"
#include "hal/sim/memory_watchdog.hpp"
#include "tests/sim/daemon/lamp_source.hpp"
#include "tests/sim/daemon/painted_take.hpp"

namespace rig::test {

// Machine time: passes when the daemon waits, and by a frame with each tick. Each wait lets the host act.
class HostTime final : public Clock {
  public:
    [[nodiscard]] std::int64_t now_us() const override { return now_us_; }
    void sleep_until_us(std::int64_t deadline_us) override {
        now_us_ = std::max(now_us_, deadline_us);
        if (on_wait) on_wait();
    }
    void interrupt() override {}
    void pass(std::int64_t time_us) { now_us_ += time_us; }
    std::function<void()> on_wait;

  private:
    std::int64_t now_us_ = 0;
};

// The other end of the link: decodes and keeps everything.
class TestHost {
  public:
    explicit TestHost(ByteLink& link) : link_(link) { static_cast<void>(link_.open()); }
    // At most `limit` bytes, as a slow reader.
    void read(std::size_t limit = 1 << 20);
    void send_bytes(ByteSpan bytes);
    void send(MessageType type, ByteSpan payload);
    template <class Message>
    void send(MessageType type, const Message& message) {
        std::array<std::byte, kMaxWirePayloadBytes> payload{};
        send(type, ByteSpan(payload).first(encode(message, payload).value()));
    }

    [[nodiscard]] std::size_t count(MessageType type) const;
    [[nodiscard]] const std::vector<std::byte>* last(MessageType type) const;
    [[nodiscard]] Health last_status() const;

    std::vector<FaceState> states;
    std::vector<std::pair<FrameHead, std::vector<std::byte>>> frames;
    [[nodiscard]] const FrameCounters& counters() const { return decoder_.counters(); }

  private:
    ByteLink& link_;
    FrameDecoder decoder_;
    StateAssembler assembler_;
    std::uint32_t sequence_ = 0;
};

struct BenchOptions {
    std::uint32_t frames = 60;
    sim::FaultPlan faults;
    bool with_pack = true;
    bool streams_by_itself = true;
    std::size_t link_capacity = 16384;
    std::string log_path;
    int frozen_frames = 3;
    FilterChoice smoothing;
    const PaintedTake* take = &painted_take();  // outlives the bench
    LampSource::Lamp lamp;                      // none: cameras take no notice of exposure and gain
    std::optional<ExposureConfig> exposure;
};

class DaemonBench {
  public:
    explicit DaemonBench(BenchOptions options = {});
    // Runs to the end; the host reads all unless `host_acts` says otherwise. It is called at each wait of the
    // daemon and before each tick.
    AppEnd run();

    std::function<void(DaemonBench&)> host_acts = [](DaemonBench& bench) { bench.host.read(); };
    // Before tick n.
    std::function<void(DaemonBench&, std::uint32_t)> before_tick;
    std::atomic<bool> stop{false};

    [[nodiscard]] App& app() { return *app_; }
    [[nodiscard]] const LampSource& lit_camera(std::size_t camera) const { return *lit_[camera]; }
    [[nodiscard]] std::uint32_t ticks_done() const { return pace_.ticks; }
    sim::ManualClock clock{1'000'000};
    HostTime wall;
    sim::LoopbackPair pair;
    TestHost host;
    sim::MemoryLine button;
    sim::MemoryLine led;
    sim::MemoryWatchdog watchdog;

  private:
    class BenchPace final : public Pace {
      public:
        explicit BenchPace(DaemonBench& bench) : bench_(bench) {}
        void tick_done() override;
        std::uint32_t ticks = 0;

      private:
        DaemonBench& bench_;
    };

    BenchOptions options_;
    std::vector<std::unique_ptr<sim::SyntheticFrameSource>> cameras_;
    std::vector<std::unique_ptr<LampSource>> lit_;
    std::vector<std::unique_ptr<sim::FaultyFrameSource>> faulty_;
    sim::FaultyLink link_;
    std::vector<std::string_view> names_;
    std::unique_ptr<Pipeline> pipeline_;
    std::unique_ptr<ObservationLogWriter> log_;
    BenchPace pace_;
    std::unique_ptr<App> app_;
};

}  // namespace rig::test
