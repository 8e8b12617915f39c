#include "core/wire/health.hpp"

#include "core/wire/session_messages.hpp"

namespace rig {

namespace {

void write_spread(ByteWriter& writer, const TimeSpread& spread) {
    writer.write(spread.p50_us);
    writer.write(spread.p99_us);
    writer.write(spread.max_us);
}

TimeSpread read_spread(ByteReader& reader) {
    TimeSpread spread;
    spread.p50_us = reader.read<std::uint32_t>();
    spread.p99_us = reader.read<std::uint32_t>();
    spread.max_us = reader.read<std::uint32_t>();
    return spread;
}

template <class T, std::size_t kCount>
void write_all(ByteWriter& writer, const std::array<T, kCount>& values) {
    for (const T& value : values) writer.write(value);
}

template <class T, std::size_t kCount>
void read_all(ByteReader& reader, std::array<T, kCount>& values) {
    for (T& value : values) value = reader.read<T>();
}

bool in_range(const Health& health) {
    return health.now_us >= -kMaxWireTime_us && health.now_us <= kMaxWireTime_us && health.uptime_us >= 0 &&
           health.uptime_us <= kMaxWireTime_us && health.state <= TrackingState::kLive;
}

}  // namespace

Result<std::size_t, WireError> encode(const Health& health, MutableByteSpan into) {
    if (!in_range(health)) return failure(WireError::kRange);
    ByteWriter writer(into);
    writer.write(health.now_us);
    writer.write(health.uptime_us);
    for (const std::uint32_t counter : {health.ticks, health.solved, health.held, health.overruns,
                                        health.frames_sent, health.frames_dropped, health.rx_good,
                                        health.rx_bad, health.heap_calls_after_seal, health.peak_memory_kb}) {
        writer.write(counter);
    }
    writer.write(health.temperature_dc);
    write_all(writer, health.camera_good);
    write_all(writer, health.camera_missing);
    write_all(writer, health.observations);
    writer.write(health.markers_seen);
    writer.write(health.swaps_repaired);
    writer.write(health.bootstraps);
    write_spread(writer, health.solve);
    write_spread(writer, health.latency);
    writer.write(health.state);
    writer.write(health.faults);
    write_all(writer, health.fault_counts);
    if (!writer.ok()) return failure(WireError::kSpace);
    return writer.size();
}

Result<Health, WireError> decode_status(ByteSpan payload) {
    if (payload.size() != kStatusBytes) return failure(WireError::kLength);
    ByteReader reader(payload);
    Health health;
    health.now_us = reader.read<std::int64_t>();
    health.uptime_us = reader.read<std::int64_t>();
    for (std::uint32_t* counter : {&health.ticks, &health.solved, &health.held, &health.overruns,
                                   &health.frames_sent, &health.frames_dropped, &health.rx_good,
                                   &health.rx_bad, &health.heap_calls_after_seal, &health.peak_memory_kb}) {
        *counter = reader.read<std::uint32_t>();
    }
    health.temperature_dc = reader.read<std::int16_t>();
    read_all(reader, health.camera_good);
    read_all(reader, health.camera_missing);
    read_all(reader, health.observations);
    health.markers_seen = reader.read<std::uint16_t>();
    health.swaps_repaired = reader.read<std::uint32_t>();
    health.bootstraps = reader.read<std::uint32_t>();
    health.solve = read_spread(reader);
    health.latency = read_spread(reader);
    health.state = reader.read<TrackingState>();
    health.faults = reader.read<FaultMap>();
    read_all(reader, health.fault_counts);
    if (!reader.ok() || reader.remaining() != 0) return failure(WireError::kLength);
    if (!in_range(health)) return failure(WireError::kRange);
    return health;
}

}  // namespace rig
