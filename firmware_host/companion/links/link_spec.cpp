#include "firmware_host/companion/links/link_spec.hpp"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <system_error>

namespace rig::host {

namespace {

constexpr int kSlowest_baud = 1200;
constexpr int kFastest_baud = 12'000'000;

std::unexpected<LinkFault> fault(std::string message) {
    return failure(LinkFault{std::move(message)});
}

std::optional<int> whole_number(std::string_view text) {
    int value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return value;
}

Result<LinkSpec, LinkFault> parse_serial(std::string_view text, std::string_view rest) {
    LinkSpec spec;
    const std::size_t at = rest.rfind('@');
    spec.path = rest.substr(0, at);
    if (spec.path.empty()) return fault(fmt::format("{}: no device is named; write {}", text, kLinkSpecHelp));
    if (at == std::string_view::npos) return spec;
    const auto baud = whole_number(rest.substr(at + 1));
    if (!baud || *baud < kSlowest_baud || *baud > kFastest_baud) {
        return fault(fmt::format("{}: '{}' is not a rate from {} to {} baud", text, rest.substr(at + 1),
                                 kSlowest_baud, kFastest_baud));
    }
    spec.baud = *baud;
    return spec;
}

Result<LinkSpec, LinkFault> parse_udp(std::string_view text, std::string_view rest) {
    LinkSpec spec;
    spec.kind = LinkSpec::Kind::kUdp;
    const std::size_t colon = rest.rfind(':');
    if (colon == std::string_view::npos || colon == 0) {
        return fault(fmt::format("{}: write udp:HOST:PORT, for example udp:127.0.0.1:7777", text));
    }
    spec.host = rest.substr(0, colon);
    if (spec.host.size() > 2 && spec.host.front() == '[' && spec.host.back() == ']') {
        spec.host = spec.host.substr(1, spec.host.size() - 2);
    }
    const auto port = whole_number(rest.substr(colon + 1));
    if (!port || *port < 1 || *port > 65535) {
        return fault(fmt::format("{}: '{}' is not a port from 1 to 65535", text, rest.substr(colon + 1)));
    }
    spec.port = static_cast<std::uint16_t>(*port);
    return spec;
}

}  // namespace

Result<LinkSpec, LinkFault> parse_link_spec(std::string_view text) {
    constexpr std::string_view kSerial = "serial:";
    constexpr std::string_view kUdp = "udp:";
    if (text.starts_with(kSerial)) return parse_serial(text, text.substr(kSerial.size()));
    if (text.starts_with(kUdp)) return parse_udp(text, text.substr(kUdp.size()));
    if (text.starts_with('/') || text.starts_with('.'))
        return LinkSpec{.path = std::string(text), .host = {}};
    return fault(fmt::format("'{}' is not a link; write {}", text, kLinkSpecHelp));
}

}  // namespace rig::host
