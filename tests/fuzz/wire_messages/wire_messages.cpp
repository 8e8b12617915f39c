// First byte: message type; the rest: its payload. A payload that a decoder accepts encodes to the same
// bytes, because every layout is canonical; what it holds is in range, whatever came in. The assemblers take
// any order of parts.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "core/wire/state_messages.hpp"
#include "tests/support/wire/messages.hpp"

namespace {

void require(bool condition) {
    if (!condition) std::abort();
}

void require_in_range(const rig::FaceState& state) {
    for (const float weight : state.weights) {
        require(weight >= rig::kWireWeightLow && weight <= rig::kWireWeightHigh);
    }
    for (const float confidence : state.confidence) require(confidence >= 0.0F && confidence <= 1.0F);
    for (const float value : state.slip.rotation_rad) require(std::isfinite(value));
}

// The payload as several parts: its own, then copies with fields of the split changed by the payload's bytes.
void assemble(rig::ByteSpan payload) {
    rig::StateAssembler states;
    rig::MarkerAssembler markers;
    if (const auto part = rig::decode_weights(payload)) {
        for (std::uint32_t step = 0; step < 8; ++step) {
            rig::WeightsPart next = *part;
            next.state.sequence += step * static_cast<std::uint32_t>(payload[0]) - 3 * (step & 1U);
            if (states.push(next)) require_in_range(states.state());
        }
        require(states.counters().whole + states.counters().abandoned + states.counters().stale <= 16);
    }
    if (const auto message = rig::decode_head_pose(payload)) {
        for (const float value : message->head.translation_sigma_mm) require(value >= 0.0F && value <= 1e6F);
        require(message->head.status == rig::HeadStatus::kKnown || message->head.points_used == 0);
    }
    if (const auto part = rig::decode_markers(payload)) {
        (void)markers.push(*part);
        (void)markers.push(*part);
        require(markers.counters().stale == 1);
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const auto payload = std::as_bytes(std::span(data + 1, size - 1));
    const auto again = rig::test::reencoded(static_cast<rig::MessageType>(data[0]), payload);
    if (again) require(std::equal(again->begin(), again->end(), payload.begin(), payload.end()));
    assemble(payload);
    return 0;
}
