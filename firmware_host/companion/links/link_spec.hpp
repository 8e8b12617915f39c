// What people write behind --link, and the link behind it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "core/base/result.hpp"
#include "hal/byte_link.hpp"
#include "hal/clock.hpp"

namespace rig::host {

struct LinkSpec {
    enum class Kind : std::uint8_t { kTerminal, kUdp };
    Kind kind = Kind::kTerminal;
    std::string path;        // terminal: the device
    int baud = 0;            // terminal: 0 keeps the device's rate
    std::string host;        // UDP
    std::uint16_t port = 0;  // UDP
};

// Names what was asked for, the fault and the remedy.
struct LinkFault {
    std::string message;
};

inline constexpr std::string_view kLinkSpecHelp =
    "serial:/dev/ttyACM0@3000000, /dev/pts/5 or udp:127.0.0.1:7777 (udp:[::1]:7777)";

// serial:PATH[@BAUD] with BAUD 1200..12000000, a path that begins with '/' or '.', or udp:HOST:PORT.
[[nodiscard]] Result<LinkSpec, LinkFault> parse_link_spec(std::string_view text);

// Opened, or why it could not be. May ask a name server.
[[nodiscard]] Result<std::unique_ptr<ByteLink>, LinkFault> open_link(std::string_view text);

// The host's monotonic clock.
[[nodiscard]] std::unique_ptr<Clock> host_clock();

}  // namespace rig::host
