// Recordings of what a board streamed: read, not solved again.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "core/wire/state_messages.hpp"
#include "firmware_host/companion/inspect/take_runs.hpp"
#include "firmware_host/companion/links/recording.hpp"

namespace rig::host {

namespace {

constexpr std::uint32_t kLongestGap = 1U << 20;  // a larger step is a board that started anew

struct StreamedState {
    FaceState state;
    std::int64_t received_us = 0;
};

struct Streamed {
    std::vector<StreamedState> states;
    std::map<std::uint32_t, MarkerFrame> markers;  // by sequence
    std::vector<std::string> marker_names;
    double rate_hz = 0.0;
    std::size_t unread_bytes = 0;
};

void take_names(ByteSpan payload, Streamed& streamed) {
    const auto page = decode_names(payload);
    if (!page || page->kind != NameKind::kMarkers || page->first != streamed.marker_names.size()) return;
    for (std::size_t i = 0; i < page->count; ++i) streamed.marker_names.emplace_back(page->names[i]);
}

Streamed read_all(RecordingReader& reader) {
    Streamed streamed;
    FrameDecoder decoder;
    StateAssembler states;
    MarkerAssembler markers;
    while (const auto entry = reader.next()) {
        ByteSpan bytes = entry->frame;
        FrameView frame;
        if (!decoder.next(bytes, frame)) continue;
        if (frame.head.type == MessageType::kNames) take_names(frame.payload, streamed);
        if (frame.head.type == MessageType::kHello) {
            const auto hello = decode_hello(frame.payload);
            if (hello && hello->rate_mhz > 0) streamed.rate_hz = 1e-3 * static_cast<double>(hello->rate_mhz);
        }
        if (frame.head.type == MessageType::kWeights) {
            const auto part = decode_weights(frame.payload);
            if (part && states.push(*part)) streamed.states.push_back({states.state(), entry->received_us});
        }
        if (frame.head.type == MessageType::kMarkers) {
            const auto part = decode_markers(frame.payload);
            if (part && markers.push(*part))
                streamed.markers.emplace(markers.frame().sequence, markers.frame());
        }
    }
    streamed.unread_bytes = reader.unread_bytes();
    return streamed;
}

// Sequences tell the time where the rate is known: a held state's capture is old, and reception jitters.
double time_of(const Streamed& streamed, std::size_t at) {
    const StreamedState& first = streamed.states.front();
    const StreamedState& one = streamed.states[at];
    if (streamed.rate_hz > 0.0)
        return static_cast<double>(one.state.sequence - first.state.sequence) / streamed.rate_hz;
    return static_cast<double>(one.received_us - first.received_us) * 1e-6;
}

void add_streamed(const StreamedState& from, double time_s, TakeRecord& record) {
    TakeTick tick;
    tick.time_s = time_s;
    tick.state = from.state.state;
    tick.solved = !from.state.held;
    tick.faults = from.state.faults;
    tick.cameras = from.state.cameras;
    if (tick.solved) {
        tick.slip_deg = slip_angle_deg(from.state.slip);
        tick.slip_mm = slip_distance_mm(from.state.slip);
    }
    record.ticks.push_back(tick);
}

// `frame` is null where the stream of markers skipped or lost a tick: what was seen before stands for it.
void add_markers(const MarkerFrame* frame, TakeRecord& record) {
    const bool solved = record.ticks.back().solved;
    const std::size_t count = record.markers.size();
    for (std::size_t k = 0; k < count; ++k) {
        const std::size_t before = record.sightings.size();
        const bool was_seen = before >= count && record.sightings[before - count] == Sighting::kVisible;
        const bool seen = frame == nullptr ? was_seen : k < frame->marker_count && frame->markers[k].seen;
        record.sightings.push_back(!solved ? Sighting::kLost
                                   : seen  ? Sighting::kVisible
                                           : Sighting::kInferred);
    }
}

void name_cameras(TakeRecord& record) {
    for (std::size_t c = 0; c < kMaxCameras; ++c) {
        const bool used = std::ranges::any_of(
            record.ticks, [c](const TakeTick& tick) { return tick.cameras[c] != CameraStatus::kUnused; });
        if (!used) return;
        record.cameras.push_back(std::to_string(c + 1));
    }
}

Result<void, FileError> set_markers(const InspectRequest& request, const SolvePack* pack,
                                    const Streamed& streamed, TakeRecord& record) {
    if (streamed.markers.empty()) {
        record.remarks.emplace_back(
            "The recording holds no markers; `headrig record --raw T.rec --markers T.npy` streams them too.");
        return {};
    }
    const std::size_t count = streamed.markers.begin()->second.marker_count;
    if (pack != nullptr && pack->marker_count != count) {
        return file_failure(request.take,
                            fmt::format("streams {} markers, but {} has {}; give the rig's own pack", count,
                                        request.pack_name, pack->marker_count));
    }
    if (pack != nullptr) record.markers = markers_of(*pack);
    for (std::size_t k = 0; k < count && pack == nullptr; ++k) {
        const bool named = k < streamed.marker_names.size();
        record.markers.push_back({named ? streamed.marker_names[k] : fmt::format("marker {}", k), {}, {}});
    }
    if (pack == nullptr) {
        record.remarks.emplace_back(
            "Without --pack nobody tells which marker sits where: the rows are in the rig's own order.");
    }
    return {};
}

}  // namespace

Result<TakeRecord, FileError> inspect_recording(const InspectRequest& request, const SolvePack* pack,
                                                const InspectProgress& progress) {
    auto reader = RecordingReader::open(request.take);
    if (!reader) return failure(reader.error());
    const Streamed streamed = read_all(*reader);
    TakeRecord record;
    record.name = request.take.filename().string();
    record.source = "recording of what the rig streamed";
    if (streamed.rate_hz > 0.0) record.rate_hz = streamed.rate_hz;
    if (streamed.states.empty())
        return file_failure(request.take, "holds no states; was the rig streaming when it was recorded?");
    if (const auto set = set_markers(request, pack, streamed, record); !set) return failure(set.error());
    std::uint32_t smallest_step = kLongestGap;
    std::uint64_t steps = 0;
    for (std::size_t i = 0; i < streamed.states.size(); ++i) {
        const std::uint32_t sequence = streamed.states[i].state.sequence;
        if (i > 0) {
            const std::uint32_t step = sequence - streamed.states[i - 1].state.sequence;
            if (step == 0 || step >= kLongestGap) {
                record.remarks.push_back(fmt::format(
                    "The rig started anew after {:.1f} s; the page ends there.", record.ticks.back().time_s));
                break;
            }
            smallest_step = std::min(smallest_step, step);
            steps += step;
        }
        add_streamed(streamed.states[i], time_of(streamed, i), record);
        const auto frame = streamed.markers.find(sequence);
        if (!streamed.markers.empty())
            add_markers(frame == streamed.markers.end() ? nullptr : &frame->second, record);
        if (!progress(i + 1, streamed.states.size())) break;
    }
    name_cameras(record);
    // A stream with divider d steps by d; the smallest step seen stands for it.
    if (steps > 0) record.missing_ticks = steps / smallest_step - (record.ticks.size() - 1);
    if (streamed.unread_bytes > 0)
        record.cut = fmt::format("{}: the last {} bytes are damaged or cut; all before them is shown",
                                 request.take.string(), streamed.unread_bytes);
    record.remarks.emplace_back(
        "A stream tells neither residuals, ghosts nor repaired names; the daemon's observation log does "
        "(`headrigd --log-observations`).");
    return record;
}

}  // namespace rig::host
