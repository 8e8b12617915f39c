// Any bytes in any chunking into the frame decoder: no crash, the same frames however the bytes are cut,
// every run counted once, and whatever is delivered encodes to a frame within the limit.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "core/wire/crc32c.hpp"
#include "core/wire/frame.hpp"

namespace {

void require(bool condition) {
    if (!condition) std::abort();
}

struct Outcome {
    std::uint64_t frames = 0;
    std::uint32_t digest = 0;
    rig::FrameCounters counters;
};

Outcome decode(rig::ByteSpan bytes, std::size_t chunk_size) {
    rig::FrameDecoder decoder;
    Outcome out;
    while (!bytes.empty()) {
        rig::ByteSpan chunk = bytes.first(chunk_size < bytes.size() ? chunk_size : bytes.size());
        bytes = bytes.subspan(chunk.size());
        rig::FrameView frame;
        while (decoder.next(chunk, frame)) {
            ++out.frames;
            require(frame.payload.size() <= rig::kMaxWirePayloadBytes);
            out.digest = out.digest * 31 + rig::crc32c(frame.payload) + frame.head.sequence;
            std::array<std::byte, rig::kMaxWireFrameBytes> again;
            require(rig::encode_frame(frame.head, frame.payload, again).has_value());
        }
        require(chunk.empty());
    }
    out.counters = decoder.counters();
    return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto bytes = std::as_bytes(std::span(data, size));
    const Outcome whole = decode(bytes, size);
    for (const std::size_t chunk : {std::size_t{1}, std::size_t{7}, std::size_t{64}}) {
        const Outcome cut = decode(bytes, chunk);
        require(cut.frames == whole.frames && cut.digest == whole.digest);
        require(cut.counters.good == whole.counters.good && cut.counters.bad() == whole.counters.bad());
    }
    require(whole.frames == whole.counters.good);
    std::uint64_t zeros = 0;
    for (const std::byte byte : bytes) zeros += byte == std::byte{0} ? 1U : 0U;
    require(whole.counters.good + whole.counters.bad() <= zeros + 1);
    return 0;
}
