#include "firmware_host/companion/links/time_sync.hpp"

#include <algorithm>

namespace rig::host {

bool TimeSync::add(const TimeReply& reply, std::int64_t host_received_us) {
    const std::int64_t waited_us = host_received_us - reply.host_sent_us;
    const std::int64_t inside_us = reply.board_sent_us - reply.board_received_us;
    const std::int64_t round_trip_us = waited_us - inside_us;
    if (waited_us < 0 || waited_us > kLongestRoundTrip_us || round_trip_us < 0) return false;
    const std::int64_t there_us = reply.board_received_us - reply.host_sent_us;
    const std::int64_t back_us = reply.board_sent_us - host_received_us;
    samples_[next_] = {(there_us + back_us) / 2, round_trip_us};
    next_ = (next_ + 1) % kSamples;
    count_ = std::min(count_ + 1, kSamples);
    return true;
}

void TimeSync::reset() {
    count_ = 0;
    next_ = 0;
}

const TimeSync::Sample& TimeSync::best() const {
    RIG_CHECK(count_ > 0);
    return *std::min_element(
        samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(count_),
        [](const Sample& a, const Sample& b) { return a.round_trip_us < b.round_trip_us; });
}

std::optional<std::int64_t> TimeSync::host_time_us(std::int64_t board_us) const {
    if (!known()) return std::nullopt;
    return board_us - offset_us();
}

}  // namespace rig::host
