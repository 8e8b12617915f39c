// A board that speaks PROTOCOL.md and solves nothing: the other side of the companion's tests. Its weights
// are a known function of tick and shape, so that a test can tell what should have arrived.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "core/wire/control_message.hpp"
#include "core/wire/frame.hpp"
#include "core/wire/health.hpp"
#include "core/wire/session_messages.hpp"
#include "core/wire/state_messages.hpp"
#include "hal/byte_link.hpp"

namespace rig::test {

struct BoardOptions {
    std::size_t shape_count = 5;
    std::size_t marker_count = 4;
    std::int64_t tick_us = 16667;
    std::int64_t clock_ahead_us = 0;       // board's clock minus the time given to poll()
    std::int64_t capture_delay_us = 8000;  // mid-exposure to sending
    std::uint32_t lose_every = 0;          // every n-th frame is lost on the line; 0: none
    std::uint32_t session_id = 0xB0A4D;
    bool busy = false;  // another host owns the session
    FaultMap faults = 0;
    bool tells_head = false;  // capability and stream; a board without refuses the stream, as older ones do
};

class SimulatedBoard {
  public:
    SimulatedBoard(ByteLink& link, const BoardOptions& options);

    void poll(std::int64_t now_us);
    // As after a power cut: another session, sequences from zero, no streams.
    void restart(std::uint32_t session_id);
    void say_goodbye();
    // Alive, but sends nothing.
    void mute(bool muted) { muted_ = muted; }
    void set_busy(bool busy) { options_.busy = busy; }

    [[nodiscard]] std::uint32_t ticks() const { return tick_; }
    [[nodiscard]] bool streams_weights() const { return (streams_ & kStreamWeights) != 0; }
    [[nodiscard]] std::uint64_t commands() const { return commands_; }
    [[nodiscard]] const std::vector<ControlMessage>& controls() const { return controls_; }
    [[nodiscard]] std::uint64_t goodbyes() const { return goodbyes_; }
    [[nodiscard]] std::uint64_t lost() const { return lost_; }

    [[nodiscard]] static float weight_of(std::uint32_t tick, std::size_t shape);

  private:
    void take(const FrameView& frame, std::int64_t now_us);
    void tick(std::int64_t now_us);
    void send_hello();
    void send_names(const NamesRequest& request);
    void send_status(std::int64_t now_us);
    template <class Message>
    void send(MessageType type, const Message& message);
    void send(MessageType type, ByteSpan payload);
    void answer(const FrameView& frame, bool good);
    void flush();

    ByteLink& link_;
    BoardOptions options_;
    std::vector<std::string> shape_names_;
    std::vector<std::string> marker_names_;
    FrameDecoder decoder_;
    std::deque<std::vector<std::byte>> unsent_;
    std::uint32_t sequence_ = 0;
    std::uint32_t tick_ = 0;
    std::optional<std::int64_t> next_tick_us_;
    std::uint8_t streams_ = 0;
    StartStreams dividers_;
    bool muted_ = false;
    std::uint64_t commands_ = 0;
    std::vector<ControlMessage> controls_;
    std::uint64_t goodbyes_ = 0;
    std::uint64_t lost_ = 0;
};

}  // namespace rig::test
