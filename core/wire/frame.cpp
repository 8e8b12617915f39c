#include "core/wire/frame.hpp"

#include "core/wire/crc32c.hpp"

namespace rig {

namespace {

constexpr std::size_t kLongestBlock = 254;  // non-zero bytes behind one code byte

// COBS as a sink: bytes go straight to their place, the code byte is filled in when its block ends.
class CobsWriter {
  public:
    explicit CobsWriter(MutableByteSpan into) : into_(into) {}

    void begin() {
        put(std::byte{0});
        open_block();
    }
    void write(ByteSpan raw) {
        for (const std::byte byte : raw) {
            if (block_ == kLongestBlock) {
                close_block();
                open_block();
            }
            if (byte == std::byte{0}) {
                close_block();
                open_block();
            } else {
                put(byte);
                ++block_;
            }
        }
    }
    void end() {
        close_block();
        put(std::byte{0});
    }
    [[nodiscard]] bool ok() const { return ok_; }
    [[nodiscard]] std::size_t size() const { return size_; }

  private:
    void open_block() {
        code_at_ = size_;
        block_ = 0;
        put(std::byte{0});
    }
    void close_block() {
        if (ok_) into_[code_at_] = static_cast<std::byte>(block_ + 1);
    }
    void put(std::byte byte) {
        if (size_ >= into_.size()) {
            ok_ = false;
            return;
        }
        into_[size_++] = byte;
    }

    MutableByteSpan into_;
    std::size_t size_ = 0;
    std::size_t code_at_ = 0;
    std::size_t block_ = 0;
    bool ok_ = true;
};

constexpr std::size_t kBadCobs = ~std::size_t{0};

// Decodes in place: the write position never passes the read position. Returns the raw length or kBadCobs.
std::size_t cobs_decode(MutableByteSpan run) {
    std::size_t from = 0;
    std::size_t to = 0;
    while (from < run.size()) {
        const auto code = std::to_integer<std::size_t>(run[from]);
        if (code == 0 || code > run.size() - from) return kBadCobs;
        for (std::size_t i = 1; i < code; ++i) run[to++] = run[from + i];
        from += code;
        if (code <= kLongestBlock && from < run.size()) run[to++] = std::byte{0};
    }
    return to;
}

}  // namespace

Result<std::size_t, WireError> encode_frame(const FrameHead& head, ByteSpan payload, MutableByteSpan into) {
    if (payload.size() > kMaxWirePayloadBytes) return failure(WireError::kLength);
    std::array<std::byte, kMaxRawFrameBytes> raw;
    ByteWriter writer(raw);
    writer.write(kWireProtocol);
    writer.write(head.type);
    writer.write(head.flags);
    writer.write(head.source);
    writer.write(head.sequence);
    writer.write(static_cast<std::uint16_t>(payload.size()));
    writer.write_bytes(payload);
    writer.write(crc32c(writer.written()));
    CobsWriter cobs(into);
    cobs.begin();
    cobs.write(writer.written());
    cobs.end();
    if (!cobs.ok()) return failure(WireError::kSpace);
    return cobs.size();
}

bool FrameDecoder::next(ByteSpan& chunk, FrameView& frame) {
    std::size_t at = 0;
    bool found = false;
    while (at < chunk.size() && !found) {
        const std::byte byte = chunk[at++];
        if (byte == std::byte{0}) {
            found = finish_run(frame);
        } else if (!skipping_ && size_ == run_.size()) {
            ++counters_.too_long;
            skipping_ = true;
        } else if (!skipping_) {
            run_[size_++] = byte;
        }
    }
    chunk = chunk.subspan(at);
    return found;
}

void FrameDecoder::reset() {
    size_ = 0;
    skipping_ = true;
}

bool FrameDecoder::finish_run(FrameView& frame) {
    const bool skipped = skipping_;
    const MutableByteSpan run{run_.data(), size_};
    skipping_ = false;
    size_ = 0;
    if (skipped || run.empty()) return false;
    const std::size_t raw_size = cobs_decode(run);
    if (raw_size == kBadCobs) {
        ++counters_.bad_cobs;
        return false;
    }
    const ByteSpan raw = run.first(raw_size);
    if (raw.size() < kFrameHeadBytes + kFrameCrcBytes) {
        ++counters_.bad_length;
        return false;
    }
    const std::size_t checked = raw.size() - kFrameCrcBytes;
    if (crc32c(raw.first(checked)) != load<std::uint32_t>(raw, checked)) {
        ++counters_.bad_crc;
        return false;
    }
    if (load<std::uint8_t>(raw, 0) != kWireProtocol) {
        ++counters_.bad_version;
        return false;
    }
    if (load<std::uint16_t>(raw, 8) != checked - kFrameHeadBytes) {
        ++counters_.bad_length;
        return false;
    }
    ++counters_.good;
    frame.head.type = load<MessageType>(raw, 1);
    frame.head.flags = load<std::uint8_t>(raw, 2);
    frame.head.source = load<std::uint8_t>(raw, 3);
    frame.head.sequence = load<std::uint32_t>(raw, 4);
    frame.payload = raw.subspan(kFrameHeadBytes, checked - kFrameHeadBytes);
    return true;
}

}  // namespace rig
