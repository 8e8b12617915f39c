// Datagrams over IPv4 or IPv6.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "hal/byte_link.hpp"
#include "hal/linux/descriptor.hpp"

namespace rig {

// A resolved address; the bytes of a sockaddr. length_bytes == 0: none.
struct UdpAddress {
    alignas(8) std::array<std::byte, 32> bytes{};
    std::uint32_t length_bytes = 0;

    [[nodiscard]] bool empty() const { return length_bytes == 0; }
};

// May ask a name server and block: for start-up, before any thread of the rig runs.
[[nodiscard]] Result<UdpAddress, LinkError> resolve_udp(const std::string& host, std::uint16_t port);

// `local` empty: any free port. `peer` given: sends there and hears only it. `peer` empty: answers whoever
// was heard last, and writes take 0 bytes until somebody was heard. A peer that is not there (refused,
// unreachable) and a full send queue are 0 bytes too. A datagram longer than the reader's span is dropped
// whole and counted.
class UdpLink final : public ByteLink {
  public:
    UdpLink(const UdpAddress& local, const UdpAddress& peer) : local_(local), fixed_peer_(peer) {}
    [[nodiscard]] Result<void, LinkError> open() override;
    void close() override;
    [[nodiscard]] Result<std::size_t, LinkError> write(ByteSpan bytes) override;
    [[nodiscard]] Result<std::size_t, LinkError> read(MutableByteSpan into) override;
    [[nodiscard]] bool is_datagram() const override { return true; }
    // 0 when not open.
    [[nodiscard]] std::uint16_t local_port() const;
    [[nodiscard]] std::uint64_t oversized_datagrams() const { return oversized_datagrams_; }

  private:
    UdpAddress local_;
    UdpAddress fixed_peer_;
    UdpAddress heard_;
    os::Descriptor socket_;
    std::uint64_t oversized_datagrams_ = 0;
};

}  // namespace rig
