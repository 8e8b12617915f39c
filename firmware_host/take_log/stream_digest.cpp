#include "firmware_host/take_log/stream_digest.hpp"

#include <array>

#include "core/wire/state_messages.hpp"

namespace rig {

void StreamDigest::add(const FaceState& state) {
    FaceState stable = state;
    stable.age_us = 0;
    stable.faults = 0;
    std::array<std::byte, kMaxWirePayloadBytes> payload{};
    for (std::size_t part = 0; part < weights_part_count(stable.shape_count); ++part) {
        const auto length = encode_weights(stable, part, payload);
        for (std::size_t i = 0; i < length.value_or(0); ++i) {
            value_ = (value_ ^ std::to_integer<std::uint64_t>(payload[i])) * 1099511628211ULL;
        }
    }
    ++ticks_;
}

}  // namespace rig
