// A host's conversation with one board, as core/wire/PROTOCOL.md section 2 has it: hello, names, time,
// streams; after a lost link or a restarted board all of it again. Not for: what is done with the states (the
// verbs), opening links (link_spec.hpp).
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/wire/control_message.hpp"
#include "core/wire/frame.hpp"
#include "core/wire/health.hpp"
#include "core/wire/session_messages.hpp"
#include "core/wire/state_messages.hpp"
#include "firmware_host/companion/links/time_sync.hpp"
#include "hal/byte_link.hpp"

namespace rig::host {

enum class SessionPhase : std::uint8_t {
    kClosed,    // the link is lost; it is opened again every 250 ms
    kGreeting,  // asking who is there
    kClaiming,  // asking to own the session; left out when no stream is wanted
    kNaming,    // fetching names
    kStarting,  // starting streams
    kReady,     // everything asked for is there
    kRefused,   // the board said no, refusal() says why; asked again every second
};

struct SessionOptions {
    // 0: only look, own nothing. kStreamHead is asked of boards that have it; states then hold the head.
    std::uint8_t streams = kStreamWeights;
    std::uint16_t weights_divider = 1;
    std::uint16_t markers_divider = 1;
    std::uint16_t status_divider = 60;
    bool names = true;
    std::uint32_t session_id = 0;
    std::string name = "headrig";
    std::string version = {};
};

// Borrowed during the callback.
struct ReceivedState {
    const FaceState& state;
    bool altered = false;          // the board could not send a number as it was
    std::int64_t received_us = 0;  // host's clock
    std::optional<std::int64_t>
        latency_us;  // mid-exposure to reception; nothing before the clocks are compared
};

struct SessionEvents {
    std::function<void(const ReceivedState&)> state;
    std::function<void(const MarkerFrame&, std::int64_t received_us)> markers;
    std::function<void(const Health&)> status;
    std::function<void(const EventMessage&)> event;
    // Every good frame of the board, whole and with delimiters, before its message is looked at.
    std::function<void(ByteSpan frame, std::int64_t received_us)> raw;
};

struct SessionCounters {
    std::uint64_t states = 0;  // handed to the caller
    std::uint64_t states_missing =
        0;                          // gaps in the states' sequence: lost on the link or replaced on the board
    std::uint64_t frames_lost = 0;  // gaps in the frames' sequence: lost on the link
    std::uint64_t refused = 0;      // good frames whose payload was malformed
    std::uint64_t unknown = 0;      // good frames of a type that this program does not know
    std::uint64_t links_lost = 0;
    std::uint64_t restarts = 0;  // boards that came back with another session id
};

// Contract: poll() never blocks and may be called at any rate; time is an argument and never goes back. Any
// bytes from the other side end in counters.
class HostSession {
  public:
    // `link` is open or will be opened by poll(); it must outlive the session.
    HostSession(ByteLink& link, SessionOptions options, SessionEvents events);

    void poll(std::int64_t now_us);

    // Asks for one status message; repeated until it has come.
    void request_status() { status_wanted_ = true; }
    // Sent at the next poll(), once: commands are not repeated, since a second neutral is not the first.
    void command(BoardCommand command) {
        command_ = command;
        command_answered_ = false;
        command_refusal_.reset();
    }
    // The board has said yes or no to the last command.
    [[nodiscard]] bool command_answered() const { return command_answered_; }
    [[nodiscard]] const std::optional<NakReason>& command_refusal() const { return command_refusal_; }
    // Sent in their order, each repeated until the board has accepted it: controls are absolute.
    void control(const ControlMessage& message) { controls_.push_back(message); }
    [[nodiscard]] std::size_t controls_waiting() const { return controls_.size(); }
    // Why the board refused a control; the ones behind it are forgotten then.
    [[nodiscard]] const std::optional<NakReason>& control_refusal() const { return control_refusal_; }
    // Stops the streams and says goodbye; no poll() after it.
    void leave();

    [[nodiscard]] SessionPhase phase() const { return phase_; }
    [[nodiscard]] const std::optional<Hello>& hello() const { return hello_; }
    // The board's cameras are not on the head, and it tells where that is.
    [[nodiscard]] bool tells_head() const { return hello_ && (hello_->capabilities & kCanStreamHead) != 0; }
    [[nodiscard]] const std::vector<std::string>& shape_names() const { return shape_names_; }
    [[nodiscard]] const std::vector<std::string>& marker_names() const { return marker_names_; }
    [[nodiscard]] const TimeSync& time_sync() const { return time_sync_; }
    [[nodiscard]] const std::string& refusal() const { return refusal_; }
    [[nodiscard]] const SessionCounters& counters() const { return counters_; }
    [[nodiscard]] const FrameCounters& frames() const { return decoder_.counters(); }
    [[nodiscard]] const AssemblyCounters& assembly() const { return states_.counters(); }
    // Host's time of the last good frame of the board; nothing before the first.
    [[nodiscard]] std::optional<std::int64_t> last_heard_us() const { return last_heard_us_; }

  private:
    void open_again(std::int64_t now_us);
    void lose_link(std::int64_t now_us);
    void receive(std::int64_t now_us);
    void take(const FrameView& frame, std::int64_t now_us);
    void take_message(const FrameView& frame, std::int64_t now_us);
    void take_hello(const Result<Hello, WireError>& hello);
    void take_names(ByteSpan payload);
    void take_ack(ByteSpan payload);
    void take_nak(ByteSpan payload);
    void take_weights(ByteSpan payload, std::int64_t now_us);
    void take_head(ByteSpan payload);
    void take_markers(ByteSpan payload, std::int64_t now_us);
    void take_time(ByteSpan payload, std::int64_t now_us);
    void take_status(ByteSpan payload);
    void take_event(ByteSpan payload);
    void count_frame_gap(std::uint32_t sequence);
    void count_state_gap(std::uint32_t sequence);

    void enter(SessionPhase phase);
    void after_greeting();
    void after_naming();
    void watch_silence(std::int64_t now_us);
    void ask(std::int64_t now_us);
    void ask_names();
    void ask_control(std::int64_t now_us);
    void ask_time(std::int64_t now_us);
    void refuse(std::string why);

    void send(MessageType type, ByteSpan payload);
    template <class Message>
    void send(MessageType type, const Message& message);
    void flush();

    ByteLink& link_;
    SessionOptions options_;
    SessionEvents events_;

    SessionPhase phase_ = SessionPhase::kGreeting;
    std::optional<std::int64_t> asked_us_;  // when the question of this phase was last asked
    std::int64_t tried_us_ = 0;             // when open() was last tried
    std::optional<std::int64_t> last_heard_us_;
    std::optional<std::int64_t> last_weights_us_;
    std::string refusal_;

    std::optional<Hello> hello_;
    std::vector<std::string> shape_names_;
    std::vector<std::string> marker_names_;
    NameKind naming_ = NameKind::kShapes;
    bool shapes_done_ = false;
    bool markers_done_ = false;

    TimeSync time_sync_;
    std::optional<std::int64_t> time_asked_us_;
    std::uint32_t times_asked_ = 0;
    bool status_wanted_ = false;
    std::optional<std::int64_t> status_asked_us_;
    std::optional<BoardCommand> command_;
    std::uint32_t command_sequence_ = 0;  // of the frame that carried it
    bool command_answered_ = false;
    std::optional<NakReason> command_refusal_;
    std::deque<ControlMessage> controls_;
    std::optional<std::int64_t> control_asked_us_;
    std::uint32_t control_sequence_ = 0;  // of the frame that carried the first of them last
    std::optional<NakReason> control_refusal_;

    FrameDecoder decoder_;
    StateAssembler states_;
    FaceState whole_;  // the last state, with the head of its tick
    std::optional<HeadPoseMessage> head_;
    MarkerAssembler markers_;
    std::optional<std::uint32_t> last_frame_;
    std::optional<std::uint32_t> last_state_;
    SessionCounters counters_;

    std::vector<std::byte> received_;  // room for one read
    std::vector<std::byte> unsent_;
    std::uint32_t sequence_ = 0;
};

}  // namespace rig::host
