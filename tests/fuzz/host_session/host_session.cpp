// A hostile board: the input is a list of messages (u8 type, u16 length, payload), framed rightly so that all
// of them reach the session, which must stay within its bounds whatever they say.
#include "firmware_host/companion/links/host_session.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "firmware_host/companion/links/session_text.hpp"
#include "tests/support/wire/messages.hpp"

namespace {

// Hands out what is put in and swallows what is written.
class PouringLink final : public rig::ByteLink {
  public:
    std::vector<std::byte> waiting;

    rig::Result<void, rig::LinkError> open() override { return {}; }
    void close() override {}
    rig::Result<std::size_t, rig::LinkError> write(rig::ByteSpan bytes) override { return bytes.size(); }
    rig::Result<std::size_t, rig::LinkError> read(rig::MutableByteSpan into) override {
        const std::size_t size = std::min(into.size(), waiting.size());
        std::memcpy(into.data(), waiting.data(), size);
        waiting.erase(waiting.begin(), waiting.begin() + static_cast<std::ptrdiff_t>(size));
        return size;
    }
    [[nodiscard]] bool is_datagram() const override { return false; }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    PouringLink link;
    rig::host::SessionEvents events;
    std::size_t text = 0;
    events.status = [&](const rig::Health& health) {
        for (const auto& line : rig::host::health_lines(health)) text += line.size();
        for (const auto& line : rig::host::fault_lines(health)) text += line.size();
    };
    events.event = [&](const rig::EventMessage& event) { text += rig::host::event_line(event).size(); };
    events.state = [](const rig::host::ReceivedState& received) {
        if (received.state.shape_count > rig::kMaxShapes) std::abort();
    };
    rig::host::HostSession session(link, {.streams = rig::kAllStreams}, std::move(events));
    rig::ByteReader reader(std::as_bytes(std::span(data, size)));
    std::int64_t now_us = 0;
    std::uint32_t sequence = 0;
    while (reader.remaining() >= 3) {
        const auto type = reader.read<rig::MessageType>();
        const std::size_t wanted = reader.read<std::uint16_t>() % (rig::kMaxWirePayloadBytes + 1);
        const std::size_t length = std::min(wanted, reader.remaining());
        const auto frame =
            rig::test::framed({type, 0, rig::kSourceBoard, sequence++}, reader.read_bytes(length));
        link.waiting.insert(link.waiting.end(), frame.begin(), frame.end());
        session.poll(now_us);
        now_us += 30'000;
    }
    if (session.shape_names().size() > rig::kMaxShapes || session.marker_names().size() > rig::kMaxMarkers)
        std::abort();
    if (session.hello()) {
        for (const auto& line : rig::host::hello_lines(*session.hello())) text += line.size();
    }
    return text > (std::size_t{1} << 40) ? 1 : 0;
}
