#include "firmware_host/companion/links/recording.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/wire/crc32c.hpp"
#include "core/wire/state_messages.hpp"
#include "firmware_host/companion/files/whole_file.hpp"

namespace rig::host {

namespace {

constexpr std::array<char, 8> kMagic = {'R', 'I', 'G', 'R', 'E', 'C', '0', '1'};
constexpr std::uint32_t kLargestGap = 1U << 20;  // more is a restart, not loss
constexpr std::size_t kEntryHeadBytes = sizeof(std::uint16_t) + sizeof(std::int64_t);
constexpr std::size_t kEntryCrcBytes = sizeof(std::uint32_t);
constexpr std::size_t kMostEntryBytes = kEntryHeadBytes + kMaxWireFrameBytes + kEntryCrcBytes;

}  // namespace

Result<RecordingWriter, FileError> RecordingWriter::create(const std::filesystem::path& path) {
    RecordingWriter writer(path);
    writer.file_.write(kMagic.data(), kMagic.size());
    if (!writer.file_)
        return file_failure(path, "cannot be written: does its folder exist, and is there room?");
    return writer;
}

Result<void, FileError> RecordingWriter::add(ByteSpan frame, std::int64_t received_us) {
    RIG_CHECK(frame.size() <= kMaxWireFrameBytes);
    std::array<std::byte, kMostEntryBytes> entry;
    ByteWriter writer(entry);
    writer.write(static_cast<std::uint16_t>(frame.size()));
    writer.write(received_us);
    writer.write_bytes(frame);
    writer.write(crc32c(writer.written()));
    file_.write(reinterpret_cast<const char*>(entry.data()), static_cast<std::streamsize>(writer.size()));
    if (!file_) return file_failure(path_, "writing failed: is the disk full?");
    ++frame_count_;
    return {};
}

Result<void, FileError> RecordingWriter::close() {
    file_.close();
    if (!file_) return file_failure(path_, "writing failed: is the disk full?");
    return {};
}

Result<RecordingReader, FileError> RecordingReader::open(const std::filesystem::path& path) {
    auto bytes = read_whole_file(path);
    if (!bytes) return failure(bytes.error());
    return parse(std::move(*bytes), path);
}

Result<RecordingReader, FileError> RecordingReader::parse(std::vector<std::byte> bytes,
                                                          const std::filesystem::path& name) {
    const auto magic = std::as_bytes(std::span(kMagic));
    if (bytes.size() < magic.size() || !std::equal(magic.begin(), magic.end(), bytes.begin())) {
        return file_failure(name, "is not a recording of `headrig record --raw`");
    }
    RecordingReader reader(std::move(bytes));
    reader.position_ = magic.size();
    return reader;
}

std::optional<RecordedFrame> RecordingReader::next() {
    const ByteSpan rest = ByteSpan(bytes_).subspan(position_);
    if (rest.size() < kEntryHeadBytes + kEntryCrcBytes) return std::nullopt;
    const std::size_t size = load<std::uint16_t>(rest, 0);
    const std::size_t checked = kEntryHeadBytes + size;
    if (size > kMaxWireFrameBytes || rest.size() < checked + kEntryCrcBytes) return std::nullopt;
    if (crc32c(rest.first(checked)) != load<std::uint32_t>(rest, checked)) return std::nullopt;
    position_ += checked + kEntryCrcBytes;
    return RecordedFrame{load<std::int64_t>(rest, sizeof(std::uint16_t)),
                         rest.subspan(kEntryHeadBytes, size)};
}

namespace {

// Pages of names arrive in order, perhaps several times.
void add_names(ByteSpan payload, RecordingSummary& summary) {
    const auto page = decode_names(payload);
    if (!page) return;
    auto& names = page->kind == NameKind::kShapes ? summary.shape_names : summary.marker_names;
    if (page->first != names.size()) return;
    for (std::size_t i = 0; i < page->count; ++i) names.emplace_back(page->names[i]);
}

}  // namespace

RecordingSummary summarise(RecordingReader& reader) {
    RecordingSummary summary;
    FrameDecoder decoder;
    StateAssembler states;
    std::optional<std::int64_t> first_us;
    std::optional<std::uint32_t> last_state;
    std::uint32_t smallest_step = kLargestGap;
    std::uint64_t ticks = 0;
    std::uint64_t steps = 0;
    while (const auto entry = reader.next()) {
        if (!first_us) first_us = entry->received_us;
        summary.seconds =
            std::max(0.0, (static_cast<double>(entry->received_us) - static_cast<double>(*first_us)) * 1e-6);
        ++summary.frames;
        ByteSpan bytes = entry->frame;
        FrameView frame;
        if (!decoder.next(bytes, frame)) {
            ++summary.bad_frames;
            continue;
        }
        ++summary.messages[frame.head.type];
        if (frame.head.type == MessageType::kNames) add_names(frame.payload, summary);
        if (frame.head.type == MessageType::kHello) {
            if (const auto hello = decode_hello(frame.payload)) summary.hello = *hello;
        }
        if (frame.head.type != MessageType::kWeights) continue;
        const auto part = decode_weights(frame.payload);
        if (!part || !states.push(*part)) continue;
        const std::uint32_t sequence = states.state().sequence;
        const std::uint32_t step = last_state ? sequence - *last_state : 0;
        if (step > 0 && step < kLargestGap) {
            smallest_step = std::min(smallest_step, step);
            ticks += step;
            ++steps;
        }
        last_state = sequence;
        ++summary.states;
    }
    // A stream with divider d steps by d; the smallest step seen stands for it.
    if (steps > 0) summary.states_missing = ticks / smallest_step - steps;
    summary.unread_bytes = reader.unread_bytes();
    return summary;
}

}  // namespace rig::host
