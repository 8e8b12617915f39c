// One daemon's visit to a served world: the conversation of hal/sim/world_protocol.hpp over one connection.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "firmware_host/companion/world/frames_ahead.hpp"
#include "firmware_host/companion/world/shared_images.hpp"
#include "firmware_host/companion/world/world_server.hpp"

namespace rig::host {

[[nodiscard]] std::int64_t monotonic_us();

class WorldSession {
  public:
    // wake: becomes readable when a frame was rendered or stop was set.
    WorldSession(const World& world, const ServerConfig& config, ServerCounters& counters,
                 FramesAhead& frames, int connection, int wake, const std::atomic<bool>& stop);

    [[nodiscard]] ServerEnd run(const WorldServer::Progress& progress);

  private:
    struct Edge {
        std::int64_t at_us;  // after the first frame
        sim::WorldLine line;
        bool active;
    };

    [[nodiscard]] bool run_lockstep(const WorldServer::Progress& progress);
    [[nodiscard]] bool run_real_time(const WorldServer::Progress& progress);
    [[nodiscard]] bool wait_for_frame(std::size_t frame, std::int64_t deadline_us, std::uint32_t& slot);
    [[nodiscard]] bool send_frame(std::size_t frame, std::uint32_t slot);
    [[nodiscard]] bool send_end();
    // Edges of buttons up to a time after the first frame.
    [[nodiscard]] bool send_presses(std::int64_t until_us);
    [[nodiscard]] bool send_edge(sim::WorldLine line, bool active, std::int64_t time_us);
    [[nodiscard]] bool send(const sim::WorldMessage& message);
    // Waits for the daemon or the renderer, no longer than the deadline; false when the visit is over.
    [[nodiscard]] bool pump(std::int64_t deadline_us);
    [[nodiscard]] bool receive();
    void obey(const sim::WorldMessage& message);
    void obey_control(const sim::WorldMessage& message);
    [[nodiscard]] std::int64_t offset_us(std::size_t frame) const;
    [[nodiscard]] std::int64_t exposure_us(std::size_t frame) const;

    const World& world_;
    const ServerConfig& config_;
    ServerCounters& counters_;
    FramesAhead& frames_;
    int connection_;
    int wake_;
    const std::atomic<bool>& stop_;
    ServerEnd end_ = ServerEnd::kDisconnected;
    std::int64_t start_us_ = 0;  // time of frame 0
    std::size_t sent_ = 0;       // frames sent or dropped: the next one's number
    std::size_t answered_ = 0;   // lockstep: ticks done
    std::vector<Edge> edges_;
    std::size_t next_edge_ = 0;
    std::array<std::byte, 64 * sizeof(sim::WorldMessage)> inbox_{};
    std::size_t inbox_bytes_ = 0;
};

}  // namespace rig::host
