#include "firmware_host/take_log/observation_log.hpp"

#include <algorithm>
#include <cmath>

#include "core/wire/crc32c.hpp"

namespace rig {

namespace {

constexpr std::array<char, 4> kMagic{'R', 'G', 'O', '1'};
constexpr std::uint16_t kVersion = 3;
constexpr std::size_t kFirstVersionHeaderBytes = 64;
constexpr std::uint8_t kFilterBit = 1;
constexpr std::uint8_t kStabiliseBit = 2;
constexpr std::uint8_t kOffHeadBit = 16;
constexpr std::uint8_t kResetBit = 1;
constexpr std::uint8_t kControlsBit = 2;
constexpr std::uint8_t kNeutralBit = 4;
constexpr std::uint8_t kForgetNeutralBit = 8;
constexpr std::uint8_t kLastStatus = static_cast<std::uint8_t>(CameraStatus::kExposure);

// How one shape is smoothed, in a byte.
std::uint8_t filter_code(const ShapeFilter& filter) {
    return filter.kind == FilterKind::kSavitzkyGolay ? filter.window_frames
                                                     : static_cast<std::uint8_t>(filter.kind);
}

ShapeFilter filter_of(std::uint8_t code) {
    if (code <= static_cast<std::uint8_t>(FilterKind::kOneEuro)) return {static_cast<FilterKind>(code)};
    return {FilterKind::kSavitzkyGolay, code};
}

void write_header(const ObservationLogHeader& header, MutableByteSpan into) {
    ByteWriter writer(into);
    writer.write(kMagic);
    writer.write(kVersion);
    writer.write(header.camera_count);
    writer.write(std::uint8_t{0});
    writer.write(header.rate_millihertz);
    writer.write(static_cast<std::uint8_t>((header.filter ? kFilterBit : 0) |
                                           (header.stabilise ? kStabiliseBit : 0) | header.loss_policy << 2 |
                                           (header.camera_on_head ? 0 : kOffHeadBit)));
    writer.write(std::array<std::uint8_t, 3>{});
    writer.write(header.pack_hash);
    writer.write(header.smoothing.delay_frames);
    writer.write(std::array<std::uint8_t, 15>{});
    for (const ShapeFilter& filter : header.smoothing.shapes) writer.write(filter_code(filter));
    RIG_CHECK(writer.ok() && writer.size() == kObservationLogHeaderBytes);
}

void write_controls(const ControlSet& set, ByteWriter& writer) {
    for (const ShapeControls& s : set.shapes) {
        writer.write(
            std::array<float, 7>{s.sparsity, s.ridge, s.temporal, s.multiplier, s.offset, s.low, s.high});
    }
    writer.write(static_cast<std::uint16_t>(set.symmetry.size()));
    for (const SymmetryPair& pair : set.symmetry) {
        writer.write(pair.left);
        writer.write(pair.right);
        writer.write(pair.strength);
    }
    writer.write(static_cast<std::uint16_t>(set.cancel.size()));
    for (const CancelPair& pair : set.cancel) {
        writer.write(pair.first);
        writer.write(pair.second);
    }
}

std::size_t write_record(const ObservationTick& tick, std::uint8_t camera_count, MutableByteSpan into) {
    ByteWriter writer(into);
    writer.write(std::uint32_t{0});
    writer.write(tick.number);
    writer.write(tick.capture_us);
    writer.write(static_cast<std::uint8_t>(
        (tick.reset_before ? kResetBit : 0) | (tick.new_controls != nullptr ? kControlsBit : 0) |
        (tick.neutral_before ? kNeutralBit : 0) | (tick.neutral_forgotten_before ? kForgetNeutralBit : 0)));
    for (std::size_t c = 0; c < kMaxCameras; ++c) {
        writer.write(c < camera_count ? tick.status[c] : CameraStatus::kUnused);
    }
    writer.write(std::array<std::uint8_t, 3>{});
    for (std::size_t c = 0; c < camera_count; ++c) {
        const std::size_t count = std::min(tick.cameras[c].size(), kMaxObservations);
        writer.write(static_cast<std::uint16_t>(count));
        for (const Observation& o : tick.cameras[c].first(count)) {
            writer.write(
                std::array<float, 6>{o.x_px, o.y_px, o.diameter_px, o.contrast, o.score, o.sigma_px});
        }
    }
    if (tick.new_controls != nullptr) write_controls(*tick.new_controls, writer);
    RIG_CHECK(writer.ok());
    store(into, 0, static_cast<std::uint32_t>(writer.size() + sizeof(std::uint32_t)));
    writer.write(crc32c(writer.written()));
    RIG_CHECK(writer.ok());
    return writer.size();
}

}  // namespace

ObservationLogWriter::ObservationLogWriter(std::unique_ptr<std::FILE, FileCloser> file,
                                           std::uint8_t camera_count)
    : file_(std::move(file)),
      camera_count_(camera_count),
      buffer_(kBufferBytes),
      record_(kMaxObservationRecordBytes) {}

ObservationLogWriter::~ObservationLogWriter() {
    static_cast<void>(drain());
}

Result<std::unique_ptr<ObservationLogWriter>, ObservationLogError> ObservationLogWriter::create(
    const std::string& path, const ObservationLogHeader& header) {
    std::unique_ptr<std::FILE, FileCloser> file(std::fopen(path.c_str(), "wb"));
    if (file == nullptr) return failure(ObservationLogError::kOpen);
    // The buffer is ours: with the library's own, a write after seal() could allocate.
    if (std::setvbuf(file.get(), nullptr, _IONBF, 0) != 0) return failure(ObservationLogError::kOpen);
    std::array<std::byte, kObservationLogHeaderBytes> head{};
    write_header(header, head);
    if (std::fwrite(head.data(), 1, head.size(), file.get()) != head.size())
        return failure(ObservationLogError::kOpen);
    return std::unique_ptr<ObservationLogWriter>(
        new ObservationLogWriter(std::move(file), header.camera_count));
}

void ObservationLogWriter::append(const ObservationTick& tick) {
    const std::size_t length = write_record(tick, camera_count_, record_);
    const std::uint64_t written = written_.load(std::memory_order_relaxed);
    const std::uint64_t waiting = written - drained_.load(std::memory_order_acquire);
    if (failed_.load(std::memory_order_relaxed) || length > kBufferBytes - waiting) {
        dropped_.fetch_add(1, std::memory_order_relaxed);
        return;
    }
    const auto at = static_cast<std::size_t>(written % kBufferBytes);
    const std::size_t until_wrap = std::min(length, kBufferBytes - at);
    std::copy_n(record_.begin(), until_wrap, buffer_.begin() + static_cast<std::ptrdiff_t>(at));
    std::copy_n(record_.begin() + static_cast<std::ptrdiff_t>(until_wrap), length - until_wrap,
                buffer_.begin());
    written_.store(written + length, std::memory_order_release);
}

bool ObservationLogWriter::drain() {
    const std::uint64_t written = written_.load(std::memory_order_acquire);
    std::uint64_t drained = drained_.load(std::memory_order_relaxed);
    while (drained < written && !failed_.load(std::memory_order_relaxed)) {
        const auto at = static_cast<std::size_t>(drained % kBufferBytes);
        const auto part =
            static_cast<std::size_t>(std::min<std::uint64_t>(written - drained, kBufferBytes - at));
        if (std::fwrite(buffer_.data() + at, 1, part, file_.get()) != part) failed_ = true;
        drained += part;
        drained_.store(drained, std::memory_order_release);
    }
    return !failed_.load(std::memory_order_relaxed);
}

Result<ObservationLogReader, ObservationLogError> ObservationLogReader::open(ByteSpan bytes) {
    if (bytes.size() < kFirstVersionHeaderBytes) return failure(ObservationLogError::kCut);
    ObservationLogReader log(bytes);
    ByteReader reader(bytes.first(std::min(bytes.size(), kObservationLogHeaderBytes)));
    const auto magic = reader.read<std::array<char, 4>>();
    const auto version = reader.read<std::uint16_t>();
    log.header_.camera_count = reader.read<std::uint8_t>();
    const auto reserved = reader.read<std::uint8_t>();
    log.header_.rate_millihertz = reader.read<std::uint32_t>();
    const auto flags = reader.read<std::uint8_t>();
    const auto padding = reader.read<std::array<std::uint8_t, 3>>();
    log.header_.pack_hash = reader.read<std::array<std::byte, 32>>();
    log.header_.smoothing.delay_frames = reader.read<std::uint8_t>();
    const auto tail = reader.read<std::array<std::uint8_t, 15>>();
    log.header_.filter = (flags & kFilterBit) != 0;
    log.header_.stabilise = (flags & kStabiliseBit) != 0;
    log.header_.camera_on_head = (flags & kOffHeadBit) == 0;
    log.header_.loss_policy = static_cast<std::uint8_t>((flags & ~kOffHeadBit) >> 2);
    const bool known = magic == kMagic && version >= 1 && version <= kVersion &&
                       log.header_.camera_count >= 1 && log.header_.camera_count <= kMaxCameras &&
                       log.header_.rate_millihertz > 0 && log.header_.rate_millihertz <= 1'000'000 &&
                       log.header_.loss_policy <= 1 && reserved == 0 &&
                       padding == std::array<std::uint8_t, 3>{} && tail == std::array<std::uint8_t, 15>{};
    if (!known) return failure(ObservationLogError::kFormat);
    log.has_sigma_ = version >= 3;
    if (version == 1) {
        log.position_ = kFirstVersionHeaderBytes;
        if (log.header_.smoothing.delay_frames != 0) return failure(ObservationLogError::kFormat);
        return log;
    }
    for (ShapeFilter& filter : log.header_.smoothing.shapes) filter = filter_of(reader.read<std::uint8_t>());
    if (!reader.ok()) return failure(ObservationLogError::kCut);
    if (!is_valid(log.header_.smoothing, kMaxShapes)) return failure(ObservationLogError::kFormat);
    return log;
}

bool ObservationLogReader::read_observations(ByteReader& reader, ObservationTick& tick) {
    for (std::size_t c = 0; c < header_.camera_count; ++c) {
        const auto count = reader.read<std::uint16_t>();
        if (count > kMaxObservations) return false;
        const std::span<Observation> place = std::span(observations_).subspan(c * kMaxObservations, count);
        for (Observation& observation : place) {
            const auto numbers = reader.read<std::array<float, 5>>();
            const float sigma_px = has_sigma_ ? reader.read<float>() : 0.0F;
            for (const float number : numbers) {
                if (!std::isfinite(number)) return false;
            }
            if (!std::isfinite(sigma_px) || sigma_px < 0.0F) return false;
            observation = {numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], sigma_px};
        }
        tick.cameras[c] = place;
    }
    return reader.ok();
}

bool ObservationLogReader::read_controls(ByteReader& reader, ObservationTick& tick) {
    for (ShapeControls& s : controls_.shapes) {
        const auto numbers = reader.read<std::array<float, 7>>();
        s = {numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5], numbers[6]};
    }
    const auto symmetry_count = reader.read<std::uint16_t>();
    if (symmetry_count > kMaxControlPairs) return false;
    controls_.symmetry.resize(symmetry_count);
    for (SymmetryPair& pair : controls_.symmetry) {
        pair.left = reader.read<std::uint16_t>();
        pair.right = reader.read<std::uint16_t>();
        pair.strength = reader.read<float>();
    }
    const auto cancel_count = reader.read<std::uint16_t>();
    if (cancel_count > kMaxControlPairs) return false;
    controls_.cancel.resize(cancel_count);
    for (CancelPair& pair : controls_.cancel) {
        pair.first = reader.read<std::uint16_t>();
        pair.second = reader.read<std::uint16_t>();
    }
    tick.new_controls = &controls_;
    return reader.ok() && check_controls(controls_, kMaxShapes).has_value();
}

Result<ObservationTick, ObservationLogError> ObservationLogReader::next() {
    RIG_CHECK(!at_end());
    const ByteSpan rest = bytes_.subspan(position_);
    if (rest.size() < sizeof(std::uint32_t)) return failure(ObservationLogError::kCut);
    const auto length = load<std::uint32_t>(rest, 0);
    if (length < kObservationRecordHeadBytes + sizeof(std::uint32_t) || length > kMaxObservationRecordBytes) {
        return failure(ObservationLogError::kDamaged);
    }
    if (length > rest.size()) return failure(ObservationLogError::kCut);
    const ByteSpan record = rest.first(length - sizeof(std::uint32_t));
    if (load<std::uint32_t>(rest, record.size()) != crc32c(record))
        return failure(ObservationLogError::kDamaged);
    ByteReader reader(record.subspan(sizeof(std::uint32_t)));
    ObservationTick tick;
    tick.number = reader.read<std::uint32_t>();
    tick.capture_us = reader.read<std::int64_t>();
    const auto flags = reader.read<std::uint8_t>();
    const auto statuses = reader.read<std::array<std::uint8_t, kMaxCameras>>();
    const auto padding = reader.read<std::array<std::uint8_t, 3>>();
    tick.reset_before = (flags & kResetBit) != 0;
    tick.neutral_before = (flags & kNeutralBit) != 0;
    tick.neutral_forgotten_before = (flags & kForgetNeutralBit) != 0;
    bool sound = flags <= (kResetBit | kControlsBit | kNeutralBit | kForgetNeutralBit) &&
                 padding == std::array<std::uint8_t, 3>{};
    for (std::size_t c = 0; c < kMaxCameras; ++c) {
        sound = sound && statuses[c] <= kLastStatus;
        tick.status[c] = static_cast<CameraStatus>(sound ? statuses[c] : 0);
    }
    sound = sound && read_observations(reader, tick);
    if (sound && (flags & kControlsBit) != 0) sound = read_controls(reader, tick);
    if (!sound || reader.remaining() != 0) return failure(ObservationLogError::kDamaged);
    position_ += length;
    return tick;
}

}  // namespace rig
