// The board's clock as seen from the host, from exchanges of four times [RFC 5905 section 8].
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/wire/session_messages.hpp"

namespace rig::host {

// Keeps the last kSamples exchanges and believes the one with the shortest round trip: delay in a queue only
// ever adds to the round trip, and half of what it adds is the error of the offset. At one exchange a second
// a drift of 50 ppm moves the estimate by at most 0.8 ms before the sample is replaced.
class TimeSync {
  public:
    static constexpr std::size_t kSamples = 16;
    static constexpr std::int64_t kLongestRoundTrip_us = 2'000'000;

    // False, and nothing kept, when the times contradict each other or the round trip is too long to say
    // anything.
    bool add(const TimeReply& reply, std::int64_t host_received_us);
    void reset();

    [[nodiscard]] bool known() const { return count_ > 0; }
    [[nodiscard]] std::size_t sample_count() const { return count_; }
    // Board's clock minus host's clock. Precondition: known().
    [[nodiscard]] std::int64_t offset_us() const { return best().offset_us; }
    // Of the sample that is believed; the offset is wrong by at most half of it. Precondition: known().
    [[nodiscard]] std::int64_t round_trip_us() const { return best().round_trip_us; }
    // On the host's clock; nothing before the first exchange.
    [[nodiscard]] std::optional<std::int64_t> host_time_us(std::int64_t board_us) const;

  private:
    struct Sample {
        std::int64_t offset_us = 0;
        std::int64_t round_trip_us = 0;
    };
    [[nodiscard]] const Sample& best() const;

    std::array<Sample, kSamples> samples_{};
    std::size_t count_ = 0;
    std::size_t next_ = 0;
};

}  // namespace rig::host
