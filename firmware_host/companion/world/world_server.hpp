// Serves a world over hal/sim/world_protocol.hpp: a Unix socket for messages, shared memory for images. What
// it is not: the world itself, which is world.hpp and needs no server.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "firmware_host/companion/world/truth_recorder.hpp"
#include "firmware_host/companion/world/world.hpp"
#include "hal/sim/world_protocol.hpp"

namespace rig::host {

// A press of a button line, 100 ms long.
struct ButtonPress {
    sim::WorldLine line = sim::WorldLine::kButtonNeutral;
    std::int64_t at_us = 0;  // after the first frame's time
};

struct ServerConfig {
    std::filesystem::path socket;
    sim::WorldPace pace = sim::WorldPace::kLockstep;
    std::uint32_t slot_count = 8;         // 4 .. 64
    std::size_t render_threads = 1;       // 1 .. 4; each renders whole frames ahead
    std::int64_t readout_us = 0;          // real time: from the end of the exposure to the message
    std::int64_t connect_timeout_us = 0;  // 0: wait for a daemon until stop()
    std::vector<ButtonPress> presses;
};

// Read from any thread while the server runs.
struct ServerCounters {
    std::atomic<std::uint64_t> rendered{0};   // frames, all cameras
    std::atomic<std::uint64_t> sent{0};       // frame sets
    std::atomic<std::uint64_t> dropped{0};    // frames never sent, for either reason below
    std::atomic<std::uint64_t> no_slot{0};    // real time: the daemon held every slot
    std::atomic<std::uint64_t> overdue{0};    // real time: rendering fell behind by more than a frame
    std::atomic<std::uint64_t> ignored{0};    // messages of the daemon that make no sense
    std::atomic<std::uint64_t> lines_set{0};  // kSetLine messages
    std::atomic<std::int64_t> start_us{
        0};  // mid-exposure of frame 0, on the run's clock; 0 before a daemon came
};

enum class ServerEnd : std::uint8_t {
    kCompleted,     // every frame was sent and, in lockstep, answered; the daemon has heard kEnd
    kDisconnected,  // the daemon went away before the end
    kStopped,       // stop() was called
    kNoDaemon,      // nobody connected in time
    kFailed,        // the socket or the memory could not be made; see fault()
};

class WorldServer {
  public:
    // `world` outlives the server. truth may be null.
    WorldServer(const World& world, ServerConfig config, TruthRecorder* truth = nullptr);
    ~WorldServer();
    WorldServer(const WorldServer&) = delete;
    WorldServer& operator=(const WorldServer&) = delete;

    // Called from the serving thread after each frame set.
    using Progress = std::function<void(std::uint64_t sent, std::uint64_t total)>;

    // Binds the socket; afterwards a daemon may connect. An old socket file that nobody listens on is
    // replaced.
    [[nodiscard]] Result<void, FileError> listen();
    // Serves one daemon in the calling thread. listen() comes first.
    [[nodiscard]] ServerEnd run(const Progress& progress = {});
    // The same in a thread of its own; join() returns how it ended.
    void start(Progress progress = {});
    [[nodiscard]] ServerEnd join();
    // Ends run() soon. Any thread, any number of times; async-signal-safe.
    void stop();

    [[nodiscard]] const ServerCounters& counters() const { return counters_; }
    [[nodiscard]] const std::string& fault() const { return fault_; }

  private:
    [[nodiscard]] int wait_for_daemon() const;

    const World& world_;
    ServerConfig config_;
    TruthRecorder* truth_;
    ServerCounters counters_;
    std::string fault_;
    int listener_ = -1;
    int wake_;  // an eventfd
    std::atomic<bool> stop_{false};
    std::jthread thread_;
    ServerEnd end_ = ServerEnd::kFailed;
};

}  // namespace rig::host
