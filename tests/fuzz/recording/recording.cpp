// Any bytes as a recording: refused, or read up to the last whole entry; the summary takes whatever the
// entries hold.
#include "firmware_host/companion/links/recording.hpp"

#include <cstddef>
#include <cstdint>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto bytes = std::as_bytes(std::span(data, size));
    auto reader = rig::host::RecordingReader::parse({bytes.begin(), bytes.end()}, "fuzz.rec");
    if (!reader) return 0;
    const auto summary = rig::host::summarise(*reader);
    if (summary.frames * 14 + summary.unread_bytes + 8 > size) std::abort();
    if (summary.bad_frames > summary.frames || summary.states > summary.frames) std::abort();
    if (!(summary.seconds >= 0.0)) std::abort();
    return 0;
}
