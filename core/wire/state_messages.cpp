#include "core/wire/state_messages.hpp"

#include "core/base/math.hpp"
#include "core/wire/session_messages.hpp"

namespace rig {

namespace {

constexpr std::uint8_t kHeldBit = 1U << 0;
constexpr std::uint8_t kAlteredBit = 1U << 1;
constexpr std::uint8_t kWeightsFlags = kHeldBit | kAlteredBit;

constexpr double kUnitsPerWeight = 16384.0;
constexpr double kUnitsPerMm = 100.0;
constexpr double kConfidenceUnits = 255.0;
constexpr float kMaxSlipSize = 1.0e6F;  // rad or mm; far beyond any slip, and finite in every later product

// Nearest integer, halves up; |value| <= 32768.
std::int32_t rounded(double value) {
    return static_cast<std::int32_t>(value + 32768.5) - 32768;
}

struct Quantised {
    std::int16_t value = 0;
    bool altered = false;
};

Quantised quantised_weight(float weight) {
    if (!is_finite(static_cast<double>(weight))) return {0, true};
    const double units = static_cast<double>(weight) * kUnitsPerWeight;
    if (units < -32768.0) return {-32768, true};
    if (units > 32767.0) return {32767, units >= 32767.5};
    return {static_cast<std::int16_t>(rounded(units)), false};
}

std::uint8_t quantised_confidence(float confidence) {
    const auto value = static_cast<double>(confidence);
    if (!(value > 0.0)) return 0;  // NaN too
    if (value >= 1.0) return 255;
    return static_cast<std::uint8_t>(value * kConfidenceUnits + 0.5);
}

std::int64_t clamped_time(std::int64_t time_us, bool& altered) {
    if (time_us >= -kMaxWireTime_us && time_us <= kMaxWireTime_us) return time_us;
    altered = true;
    return time_us < 0 ? -kMaxWireTime_us : kMaxWireTime_us;
}

std::uint32_t saturated_age(std::int64_t age_us) {
    constexpr std::int64_t kLargest = 0xFFFFFFFF;
    if (age_us < 0) return 0;
    return static_cast<std::uint32_t>(age_us < kLargest ? age_us : kLargest);
}

bool is_slip_number(float value) {
    return value >= -kMaxSlipSize && value <= kMaxSlipSize;  // false for NaN
}

float clamped_slip(float value, bool& altered) {
    if (is_slip_number(value)) return value;
    altered = true;
    return 0.0F;
}

bool good_enums(const FaceState& state) {
    bool good = state.state <= TrackingState::kLive;
    for (const CameraStatus status : state.cameras) good = good && status <= CameraStatus::kExposure;
    return good;
}

// Which elements part `part` of `total` carries.
struct PartRange {
    std::uint16_t first;
    std::uint16_t count;
};

PartRange part_range(std::size_t part, std::size_t total, std::size_t per_part) {
    const std::size_t first = part * per_part;
    const std::size_t rest = total - first;
    return {static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(rest < per_part ? rest : per_part)};
}

struct QuantisedState {
    Slip slip;
    std::int64_t capture_us = 0;
    std::array<std::int16_t, kWeightsPerPart> weights{};
    std::array<std::uint8_t, kWeightsPerPart> confidence{};
    bool altered = false;
};

QuantisedState quantised(const FaceState& state, PartRange range) {
    QuantisedState out;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        out.slip.rotation_rad[axis] = clamped_slip(state.slip.rotation_rad[axis], out.altered);
        out.slip.translation_mm[axis] = clamped_slip(state.slip.translation_mm[axis], out.altered);
    }
    out.capture_us = clamped_time(state.capture_us, out.altered);
    for (std::size_t i = 0; i < range.count; ++i) {
        const float weight = state.weights[range.first + i];
        const Quantised q = quantised_weight(weight);
        out.weights[i] = q.value;
        out.altered = out.altered || q.altered;
        out.confidence[i] = is_finite(static_cast<double>(weight))
                                ? quantised_confidence(state.confidence[range.first + i])
                                : std::uint8_t{0};
    }
    return out;
}

}  // namespace

Result<std::size_t, WireError> encode_weights(const FaceState& state, std::size_t part,
                                              MutableByteSpan into) {
    if (state.shape_count > kMaxShapes || !good_enums(state)) return failure(WireError::kRange);
    const std::size_t part_count = weights_part_count(state.shape_count);
    if (part >= part_count) return failure(WireError::kRange);
    const PartRange range = part_range(part, state.shape_count, kWeightsPerPart);
    const QuantisedState q = quantised(state, range);
    ByteWriter writer(into);
    writer.write(state.sequence);
    writer.write(q.capture_us);
    writer.write(saturated_age(state.age_us));
    writer.write(state.faults);
    writer.write(q.slip.rotation_rad);
    writer.write(q.slip.translation_mm);
    writer.write(state.cameras);
    writer.write(state.state);
    writer.write(static_cast<std::uint8_t>((state.held ? kHeldBit : 0U) | (q.altered ? kAlteredBit : 0U)));
    writer.write(static_cast<std::uint8_t>(part));
    writer.write(static_cast<std::uint8_t>(part_count));
    writer.write(state.shape_count);
    writer.write(range.first);
    writer.write(range.count);
    for (std::size_t i = 0; i < range.count; ++i) writer.write(q.weights[i]);
    for (std::size_t i = 0; i < range.count; ++i) writer.write(q.confidence[i]);
    if (!writer.ok()) return failure(WireError::kSpace);
    return writer.size();
}

namespace {

// The fields before the weights; `flags` and the part's numbers are checked by the caller.
void read_weights_head(ByteReader& reader, WeightsPart& out, std::uint8_t& flags) {
    FaceState& state = out.state;
    state.sequence = reader.read<std::uint32_t>();
    state.capture_us = reader.read<std::int64_t>();
    state.age_us = reader.read<std::uint32_t>();
    state.faults = reader.read<FaultMap>();
    state.slip.rotation_rad = reader.read<std::array<float, 3>>();
    state.slip.translation_mm = reader.read<std::array<float, 3>>();
    state.cameras = reader.read<std::array<CameraStatus, kMaxCameras>>();
    state.state = reader.read<TrackingState>();
    flags = reader.read<std::uint8_t>();
    state.held = (flags & kHeldBit) != 0;
    out.altered = (flags & kAlteredBit) != 0;
    out.part = reader.read<std::uint8_t>();
    out.part_count = reader.read<std::uint8_t>();
    state.shape_count = reader.read<std::uint16_t>();
    out.first = reader.read<std::uint16_t>();
    out.count = reader.read<std::uint16_t>();
}

// Total, part and range name each other: only the one split of PROTOCOL.md is accepted.
bool is_the_split(std::size_t total, std::size_t part, std::size_t part_count, std::size_t wanted_parts,
                  std::size_t per_part, std::size_t first, std::size_t count) {
    if (part_count != wanted_parts || part >= part_count) return false;
    const PartRange range = part_range(part, total, per_part);
    return range.first == first && range.count == count;
}

bool good_numbers(const FaceState& state) {
    bool good = state.capture_us >= -kMaxWireTime_us && state.capture_us <= kMaxWireTime_us;
    for (const float value : state.slip.rotation_rad) good = good && is_slip_number(value);
    for (const float value : state.slip.translation_mm) good = good && is_slip_number(value);
    return good;
}

}  // namespace

Result<WeightsPart, WireError> decode_weights(ByteSpan payload) {
    ByteReader reader(payload);
    WeightsPart out;
    std::uint8_t flags = 0;
    read_weights_head(reader, out, flags);
    if (!reader.ok()) return failure(WireError::kLength);
    FaceState& state = out.state;
    if ((flags & ~kWeightsFlags) != 0 || !good_enums(state) || !good_numbers(state) ||
        state.shape_count > kMaxShapes ||
        !is_the_split(state.shape_count, out.part, out.part_count, weights_part_count(state.shape_count),
                      kWeightsPerPart, out.first, out.count)) {
        return failure(WireError::kRange);
    }
    if (reader.remaining() != out.count * kWeightBytes) return failure(WireError::kLength);
    for (std::size_t i = 0; i < out.count; ++i) {
        state.weights[out.first + i] = static_cast<float>(reader.read<std::int16_t>() * kWeightStep);
    }
    for (std::size_t i = 0; i < out.count; ++i) {
        state.confidence[out.first + i] = static_cast<float>(reader.read<std::uint8_t>() / kConfidenceUnits);
    }
    return out;
}

namespace {

constexpr std::uint8_t kSeenBit = 1U << 7;
constexpr double kMarkerUnitsBound = 32767.5;  // what rounds to 32767 is still sent

// All axes within the wire's range.
bool fits(const std::array<float, 3>& position_mm) {
    bool good = true;
    for (const float value : position_mm) {
        const double units = static_cast<double>(value) * kUnitsPerMm;
        good = good && units > -kMarkerUnitsBound && units < kMarkerUnitsBound;  // false for NaN
    }
    return good;
}

void write_marker(ByteWriter& writer, const MarkerSample& sample) {
    const bool seen = sample.seen && fits(sample.position_mm);
    for (const float value : sample.position_mm) {
        const double units = seen ? static_cast<double>(value) * kUnitsPerMm : 0.0;
        writer.write(static_cast<std::int16_t>(rounded(units)));
    }
    writer.write(static_cast<std::uint8_t>(seen ? kSeenBit | sample.views : 0U));
}

// False when the bytes hold no marker that write_marker() could have written.
bool read_marker(ByteReader& reader, MarkerSample& sample) {
    std::int32_t size = 0;
    bool in_range = true;
    for (float& value : sample.position_mm) {
        const auto units = reader.read<std::int16_t>();
        in_range = in_range && units != -32768;
        size |= units;
        value = static_cast<float>(units / kUnitsPerMm);
    }
    const auto views = reader.read<std::uint8_t>();
    sample.seen = (views & kSeenBit) != 0;
    sample.views = views & ~kSeenBit;
    return in_range && (sample.seen ? sample.views <= kMaxCameras : views == 0 && size == 0);
}

}  // namespace

MarkerFrame marker_frame(const NamedMarkers& markers, std::uint32_t sequence) {
    MarkerFrame frame;
    frame.sequence = sequence;
    frame.capture_us = markers.capture_us;
    frame.marker_count = markers.count;
    for (std::size_t i = 0; i < markers.count && i < kMaxMarkers; ++i) {
        const NamedMarker& marker = markers.markers[i];
        if (!marker.seen) continue;
        frame.markers[i] = {
            true,
            marker.views,
            {static_cast<float>(marker.position_mm[0]), static_cast<float>(marker.position_mm[1]),
             static_cast<float>(marker.position_mm[2])}};
    }
    return frame;
}

Result<std::size_t, WireError> encode_markers(const MarkerFrame& frame, std::size_t part,
                                              MutableByteSpan into) {
    if (frame.marker_count > kMaxMarkers) return failure(WireError::kRange);
    const std::size_t part_count = markers_part_count(frame.marker_count);
    if (part >= part_count) return failure(WireError::kRange);
    const PartRange range = part_range(part, frame.marker_count, kMarkersPerPart);
    bool altered = false;
    ByteWriter writer(into);
    writer.write(frame.sequence);
    writer.write(clamped_time(frame.capture_us, altered));
    writer.write(frame.marker_count);
    writer.write(range.first);
    writer.write(range.count);
    writer.write(static_cast<std::uint8_t>(part));
    writer.write(static_cast<std::uint8_t>(part_count));
    for (std::size_t i = 0; i < range.count; ++i) {
        const MarkerSample& sample = frame.markers[range.first + i];
        if (sample.views > kMaxCameras) return failure(WireError::kRange);
        write_marker(writer, sample);
    }
    if (!writer.ok()) return failure(WireError::kSpace);
    return writer.size();
}

Result<MarkersPart, WireError> decode_markers(ByteSpan payload) {
    ByteReader reader(payload);
    MarkersPart out;
    MarkerFrame& frame = out.frame;
    frame.sequence = reader.read<std::uint32_t>();
    frame.capture_us = reader.read<std::int64_t>();
    frame.marker_count = reader.read<std::uint16_t>();
    out.first = reader.read<std::uint16_t>();
    out.count = reader.read<std::uint16_t>();
    out.part = reader.read<std::uint8_t>();
    out.part_count = reader.read<std::uint8_t>();
    if (!reader.ok()) return failure(WireError::kLength);
    if (frame.capture_us < -kMaxWireTime_us || frame.capture_us > kMaxWireTime_us ||
        frame.marker_count > kMaxMarkers ||
        !is_the_split(frame.marker_count, out.part, out.part_count, markers_part_count(frame.marker_count),
                      kMarkersPerPart, out.first, out.count)) {
        return failure(WireError::kRange);
    }
    if (reader.remaining() != out.count * kMarkerBytes) return failure(WireError::kLength);
    for (std::size_t i = 0; i < out.count; ++i) {
        if (!read_marker(reader, frame.markers[out.first + i])) return failure(WireError::kRange);
    }
    return out;
}

namespace {

using HeadNumbers = std::array<float, 13>;  // in the order of the wire; from the seventh on none is negative
constexpr std::size_t kFirstSigma = 6;

HeadNumbers numbers_of(const HeadPlace& head) {
    HeadNumbers out{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        out[axis] = head.rotation_rad[axis];
        out[3 + axis] = head.translation_mm[axis];
        out[6 + axis] = head.rotation_sigma_rad[axis];
        out[9 + axis] = head.translation_sigma_mm[axis];
    }
    out[12] = head.rms_px;
    return out;
}

void put_numbers(const HeadNumbers& numbers, HeadPlace& head) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        head.rotation_rad[axis] = numbers[axis];
        head.translation_mm[axis] = numbers[3 + axis];
        head.rotation_sigma_rad[axis] = numbers[6 + axis];
        head.translation_sigma_mm[axis] = numbers[9 + axis];
    }
    head.rms_px = numbers[12];
}

bool good_head_numbers(const HeadNumbers& numbers) {
    bool good = true;
    for (std::size_t i = 0; i < numbers.size(); ++i)
        good = good && is_slip_number(numbers[i]) && (i < kFirstSigma || numbers[i] >= 0.0F);
    return good;
}

}  // namespace

Result<std::size_t, WireError> encode(const HeadPoseMessage& message, MutableByteSpan into) {
    if (message.head.status > HeadStatus::kMistaken) return failure(WireError::kRange);
    HeadNumbers numbers = numbers_of(message.head);
    HeadStatus status = message.head.status;
    if (status == HeadStatus::kKnown && !good_head_numbers(numbers)) status = HeadStatus::kUncertain;
    const bool known = status == HeadStatus::kKnown;
    if (!known) numbers = HeadNumbers{};
    bool altered = false;
    ByteWriter writer(into);
    writer.write(message.sequence);
    writer.write(clamped_time(message.head.capture_us, altered));
    writer.write(status);
    writer.write(std::uint8_t{0});
    writer.write(known ? message.head.points_used : std::uint16_t{0});
    writer.write(numbers);
    if (!writer.ok()) return failure(WireError::kSpace);
    return writer.size();
}

Result<HeadPoseMessage, WireError> decode_head_pose(ByteSpan payload) {
    if (payload.size() != kHeadPoseBytes) return failure(WireError::kLength);
    ByteReader reader(payload);
    HeadPoseMessage out;
    HeadPlace& head = out.head;
    out.sequence = reader.read<std::uint32_t>();
    head.capture_us = reader.read<std::int64_t>();
    head.status = reader.read<HeadStatus>();
    const auto reserved = reader.read<std::uint8_t>();
    head.points_used = reader.read<std::uint16_t>();
    const ByteSpan rest = payload.subspan(payload.size() - reader.remaining());
    put_numbers(reader.read<HeadNumbers>(), head);
    bool good = reserved == 0 && head.status <= HeadStatus::kMistaken &&
                head.capture_us >= -kMaxWireTime_us && head.capture_us <= kMaxWireTime_us &&
                good_head_numbers(numbers_of(head));
    if (head.status != HeadStatus::kKnown) {
        good = good && head.points_used == 0;
        for (const std::byte each : rest) good = good && each == std::byte{0};  // minus zero is no zero here
    }
    if (!good) return failure(WireError::kRange);
    return out;
}

PartLedger::Verdict PartLedger::accept(std::uint32_t sequence, std::uint16_t total, std::uint8_t part,
                                       std::uint8_t part_count) {
    RIG_CHECK(part < part_count && part_count <= 32);
    const std::uint32_t bit = 1U << part;
    const auto step = static_cast<std::int32_t>(sequence - sequence_);
    const bool same = any_ && step == 0 && total == total_ && part_count == part_count_;
    const bool older = any_ && step < 0 && step >= -kReorderWindow;
    if (older || (same && (have_ & bit) != 0)) {
        ++counters_.stale;
        return Verdict::kStale;
    }
    if (same) {
        have_ |= bit;
        return Verdict::kJoins;
    }
    abandon();
    any_ = true;
    done_ = false;
    sequence_ = sequence;
    total_ = total;
    part_count_ = part_count;
    have_ = bit;
    return Verdict::kStarts;
}

bool PartLedger::complete() {
    const std::uint32_t all = part_count_ == 32 ? 0xFFFFFFFFU : (1U << part_count_) - 1U;
    if (!any_ || done_ || have_ != all) return false;
    done_ = true;
    ++counters_.whole;
    return true;
}

void PartLedger::reset() {
    abandon();
    any_ = false;
}

void PartLedger::abandon() {
    if (!any_ || done_) return;
    ++counters_.abandoned;
    for (std::uint8_t part = 0; part < part_count_; ++part) {
        if ((have_ & (1U << part)) == 0) ++counters_.lost_parts;
    }
}

bool StateAssembler::push(const WeightsPart& part) {
    switch (ledger_.accept(part.state.sequence, part.state.shape_count, part.part, part.part_count)) {
        case PartLedger::Verdict::kStale:
            return false;
        case PartLedger::Verdict::kStarts:
            state_ = part.state;
            altered_ = part.altered;
            break;
        case PartLedger::Verdict::kJoins:
            altered_ = altered_ || part.altered;
            for (std::size_t i = part.first; i < std::size_t{part.first} + part.count; ++i) {
                state_.weights[i] = part.state.weights[i];
                state_.confidence[i] = part.state.confidence[i];
            }
            break;
    }
    return ledger_.complete();
}

bool MarkerAssembler::push(const MarkersPart& part) {
    switch (ledger_.accept(part.frame.sequence, part.frame.marker_count, part.part, part.part_count)) {
        case PartLedger::Verdict::kStale:
            return false;
        case PartLedger::Verdict::kStarts:
            frame_ = part.frame;
            break;
        case PartLedger::Verdict::kJoins:
            for (std::size_t i = part.first; i < std::size_t{part.first} + part.count; ++i) {
                frame_.markers[i] = part.frame.markers[i];
            }
            break;
    }
    return ledger_.complete();
}

}  // namespace rig
