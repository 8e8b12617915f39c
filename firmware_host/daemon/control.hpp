// What the host asks, and the answers: hello, names, time, streams, status, commands (core/wire/PROTOCOL.md).
// Bounded work per call whatever arrives. Not for: bytes on the link (link_port.hpp).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "core/wire/frame.hpp"
#include "core/wire/session_messages.hpp"
#include "firmware_host/daemon/link_port.hpp"
#include "firmware_host/daemon/tick_solver.hpp"
#include "firmware_host/daemon/token_bucket.hpp"
#include "hal/clock.hpp"

namespace rig {

struct BoardIdentity {
    Hello hello;  // as this board says it
    std::span<const std::string_view> shape_names;
    std::span<const std::string_view> marker_names;
    StartStreams first_streams{.mask = 0};  // run without a host asking; mask 0: none
};

class Control {
  public:
    // `clock` is the rig's, told in time replies; `wall` times sessions and rates.
    Control(LinkPort& port, TickSolver& solver, const Clock& clock, const Clock& wall,
            const BoardIdentity& identity);

    // Reads and answers what has come, within a budget of bytes and messages.
    void service();
    // Says goodbye; the port still has to send it.
    void leave();
    // A host has started a stream, or streams run by themselves.
    [[nodiscard]] bool is_streaming() const { return port_.streams() != 0; }
    // A host owns the session.
    [[nodiscard]] bool has_owner() const { return owned_; }

  private:
    [[nodiscard]] bool next_frame(FrameView& frame);
    void handle(const FrameView& frame);
    void handle_hello(const FrameView& frame);
    void handle_names(const FrameView& frame);
    void handle_time(const FrameView& frame);
    void handle_goodbye(const FrameView& frame);
    void handle_start(const FrameView& frame);
    void handle_stop(const FrameView& frame);
    void handle_status(const FrameView& frame);
    void handle_command(const FrameView& frame);
    void handle_control(const FrameView& frame);
    void acknowledge(const FrameView& frame);
    void refuse(const FrameView& frame, NakReason reason);
    void release_session();

    LinkPort& port_;
    TickSolver& solver_;
    const Clock& clock_;
    const Clock& wall_;
    BoardIdentity identity_;
    FrameDecoder decoder_;
    std::array<std::byte, 1024> inbox_{};
    ByteSpan unread_;
    bool owned_ = false;
    std::uint32_t owner_ = 0;  // session id of the host; 0 when it never said hello
    std::int64_t heard_us_ = 0;
    ControlSet controls_;  // as they were last accepted
    TokenBucket messages_{500, 100};
    TokenBucket naks_{10, 10};
};

}  // namespace rig
