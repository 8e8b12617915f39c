// The daemon's side of the boundary to a simulated world (world_protocol.hpp, WORLD.md): one camera, clock
// and line backend each, all fed by one connection.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "core/base/result.hpp"
#include "hal/clock.hpp"
#include "hal/frame_source.hpp"
#include "hal/gpio_line.hpp"
#include "hal/sim/world_protocol.hpp"

namespace rig::sim {

enum class WorldError : std::uint8_t {
    kNoWorld,       // nobody listens at that path
    kRefusedHello,  // what listens there does not keep the protocol
    kNoMemory,      // the images could not be mapped
};

struct WorldPatience {
    std::int64_t connect_us = 5'000'000;  // for the socket to appear and the hello to come
    std::int64_t silence_us =
        60'000'000;  // lockstep: wall time without a message after which the world counts as gone
};

// Lockstep: the clock is the time of the last message, everything runs in one thread, and messages are read
// only while something waits: wait_frame(), wait_edge() and sleep_until_us() with a deadline ahead. While a
// frame set waits for tick_done() the world says nothing, so these return at once then (kTimeout; the clock
// stands still). Real time: the clock is CLOCK_MONOTONIC and a thread of the client reads messages as they
// come. In both: after the world's end queued frames are delivered, then kEnded; a world that is gone or
// breaks the protocol is kGone everywhere, for good, and fault() says why.
class WorldClient {
  public:
    [[nodiscard]] static Result<std::unique_ptr<WorldClient>, WorldError> connect(
        const std::string& socket_path, WorldPatience patience = {});
    ~WorldClient();
    WorldClient(const WorldClient&) = delete;
    WorldClient& operator=(const WorldClient&) = delete;

    [[nodiscard]] const WorldHello& hello() const;
    [[nodiscard]] Clock& clock();
    // camera < hello().camera_count.
    [[nodiscard]] FrameSource& camera(std::size_t camera);
    [[nodiscard]] GpioLine& line(WorldLine line);

    // Lockstep: lets the world go on to the next frame set. Nothing when no frame set waits, or in real time.
    void tick_done();

    [[nodiscard]] bool ended() const;                    // the world said that no more frames come
    [[nodiscard]] const char* fault() const;             // why the world is gone, nullptr while it is not
    [[nodiscard]] std::uint64_t dropped_frames() const;  // that this side was too slow to take

  private:
    class Connection;
    class WorldClock;
    class WorldCamera;
    class WorldGpio;
    WorldClient();

    std::unique_ptr<Connection> connection_;
    std::unique_ptr<WorldClock> clock_;
    std::array<std::unique_ptr<WorldCamera>, kMaxCameras> cameras_;
    std::array<std::unique_ptr<WorldGpio>, kWorldLineCount> lines_;
};

}  // namespace rig::sim
