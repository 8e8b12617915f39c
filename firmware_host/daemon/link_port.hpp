// The daemon's end of the link to the host. Out: replies in a small queue, streams as "latest wins": one
// state being sent, one waiting, an older one replaced and counted (F24). A frame that was begun is finished
// before any other byte (F25). Never blocks. Not for: what messages mean (control.hpp).
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "core/base/ring.hpp"
#include "core/wire/frame.hpp"
#include "core/wire/session_messages.hpp"
#include "firmware_host/daemon/tick_solver.hpp"
#include "firmware_host/daemon/token_bucket.hpp"
#include "hal/byte_link.hpp"

namespace rig {

// Facts about the process that only its platform knows.
struct Vitals {
    std::uint32_t (*heap_calls_after_seal)() = nullptr;
    std::uint32_t (*peak_memory_kb)() = nullptr;
};

class LinkPort {
  public:
    // `clock` is the rig's, for ages and latencies; `wall` measures what the host does to us.
    LinkPort(ByteLink& link, const Clock& clock, const Clock& wall, Vitals vitals);

    [[nodiscard]] bool open();
    // The link has been opened already: opening it again would send a host away that has joined.
    void adopt() { is_up_ = true; }
    void close() { link_.close(); }

    // Streams. A tick is due when `divider` ticks have passed since the last one of that stream.
    void start_streams(const StartStreams& start);
    void stop_streams(std::uint8_t mask) { streams_.mask = static_cast<std::uint8_t>(streams_.mask & ~mask); }
    [[nodiscard]] std::uint8_t streams() const { return streams_.mask; }

    // Newest state. Replaces one that has not begun to be sent.
    void offer(const TickOutput& output);
    // States that were replaced before they came here. Any thread.
    void note_replaced() { replaced_.fetch_add(1, std::memory_order_relaxed); }
    // A status frame soon, stream or not.
    void request_status() { status_wanted_ = true; }
    // The same for a host that asked, and before it which markers are in trouble, when some are.
    void answer_status();
    // False when the queue is full: the host asks again.
    bool reply(MessageType type, ByteSpan payload);
    template <class Message>
    bool reply(MessageType type, const Message& message) {
        std::array<std::byte, kMaxWirePayloadBytes> payload{};
        const auto length = encode(message, payload);
        return length && reply(type, ByteSpan(payload).first(*length));
    }

    // As much as the link takes now. Opens a lost link again.
    void pump_out();
    // Nothing waits and nothing is under way.
    [[nodiscard]] bool drained() const;
    [[nodiscard]] std::uint64_t bytes_taken() const { return bytes_taken_; }

    // What the host sent; 0 when nothing or when the link is down.
    [[nodiscard]] std::size_t read(MutableByteSpan into);

    // Faults of the way to the host, and those that control found in what it says.
    void raise(Fault fault) { raised_ |= fault_bit(fault); }
    void note_received(const FrameCounters& received) { received_ = received; }
    // The solver's part with the link's added.
    [[nodiscard]] Health health(const Health& of_solver) const;

  private:
    enum class Stage : std::uint8_t { kHead, kWeights, kMarkers, kStatus, kNothing };
    struct Due {
        bool head = false;  // only ever with weights
        bool weights = false;
        bool markers = false;
        bool status = false;
        [[nodiscard]] bool any() const { return weights || markers || status; }
    };
    struct Reply {
        MessageType type = MessageType::kAck;
        std::uint16_t length = 0;
        std::array<std::byte, kMaxWirePayloadBytes> payload{};
    };
    static constexpr std::size_t kReplies = 16;

    [[nodiscard]] bool flush();
    [[nodiscard]] bool load_next_frame();
    [[nodiscard]] bool load_stream_frame();
    void skip_undue_stages();
    void begin_waiting();
    void put_frame(MessageType type, ByteSpan payload);
    void finish_frame();
    void next_part(std::size_t parts, Stage after);
    void lose_link();
    void reopen_when_due();
    void watch_stall(bool took);
    void tell_faults();
    void tell_neutral();

    ByteLink& link_;
    const Clock& clock_;
    const Clock& wall_;
    Vitals vitals_;
    bool is_up_ = false;
    std::int64_t retry_us_ = 0;

    std::array<std::byte, kMaxWireFrameBytes> frame_{};  // being sent
    std::size_t frame_bytes_ = 0;
    std::size_t frame_sent_ = 0;
    std::uint32_t sequence_ = 0;  // of wire frames

    Ring<Reply, kReplies> replies_;
    TickOutput sending_;
    Due sending_due_;
    Stage stage_ = Stage::kNothing;
    std::size_t part_ = 0;
    TickOutput waiting_;
    Due waiting_due_;
    bool is_waiting_ = false;

    StartStreams streams_;
    bool any_offered_ = false;
    std::uint32_t weights_at_ = 0;  // state sequence of the last one
    std::uint32_t markers_at_ = 0;
    std::uint32_t status_at_ = 0;
    bool status_wanted_ = false;

    std::uint32_t states_sent_ = 0;
    std::atomic<std::uint32_t> replaced_{0};
    std::uint64_t bytes_taken_ = 0;
    std::int64_t blocked_since_us_ = -1;
    bool stalled_ = false;
    FaultMap raised_ = 0;  // since the last look
    FaultMap link_faults_ = 0;
    FaultBook link_book_;
    FaultBook told_;  // what events have said
    std::uint32_t neutrals_told_ = 0;
    TokenBucket events_{10, 20};
    FrameCounters received_;
    TimeBook latencies_;
};

}  // namespace rig
