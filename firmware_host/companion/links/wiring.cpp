// The one place of the companion that names concrete backends.
#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <system_error>

#include "firmware_host/companion/links/link_spec.hpp"
#include "hal/linux/monotonic_clock.hpp"
#include "hal/linux/tty_link.hpp"
#include "hal/linux/udp_link.hpp"

namespace rig::host {

namespace {

std::unexpected<LinkFault> fault(std::string message) {
    return failure(LinkFault{std::move(message)});
}

// Why a terminal device did not open, as far as can be told from outside.
std::string terminal_fault(std::string_view text, const std::string& path) {
    std::error_code ignored;
    if (!std::filesystem::exists(path, ignored)) {
        return fmt::format("{}: there is no {}: is the rig plugged in, or headrigd running?", text, path);
    }
    if (!std::filesystem::is_character_file(path, ignored)) {
        return fmt::format("{}: {} is not a serial device", text, path);
    }
    if (access(path.c_str(), R_OK | W_OK) != 0) {
        return fmt::format("{}: no permission for {}: add yourself to the group that owns it (ls -l {})",
                           text, path, path);
    }
    return fmt::format("{}: {} does not open as a serial port at this rate, or another program holds it",
                       text, path);
}

Result<std::unique_ptr<ByteLink>, LinkFault> open_udp(std::string_view text, const LinkSpec& spec) {
    const auto peer = resolve_udp(spec.host, spec.port);
    if (!peer) return fault(fmt::format("{}: the host name '{}' is not known", text, spec.host));
    auto link = std::make_unique<UdpLink>(UdpAddress{}, *peer);
    if (!link->open()) return fault(fmt::format("{}: the network refuses a socket to {}", text, spec.host));
    return link;
}

}  // namespace

Result<std::unique_ptr<ByteLink>, LinkFault> open_link(std::string_view text) {
    const auto spec = parse_link_spec(text);
    if (!spec) return failure(spec.error());
    if (spec->kind == LinkSpec::Kind::kUdp) return open_udp(text, *spec);
    auto link = std::make_unique<TtyLink>(spec->path, spec->baud);
    if (!link->open()) return fault(terminal_fault(text, spec->path));
    return link;
}

std::unique_ptr<Clock> host_clock() {
    return std::make_unique<MonotonicClock>();
}

}  // namespace rig::host
