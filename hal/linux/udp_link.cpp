#include "hal/linux/udp_link.hpp"

#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstddef>
#include <cstring>

#include "hal/linux/system_call.hpp"

namespace rig {

namespace {

// Strangers' and oversized datagrams that one read() passes over before it gives up until the next call.
constexpr int kDatagramsPerRead = 16;

static_assert(sizeof(sockaddr_in6) <= sizeof(UdpAddress::bytes));

sockaddr_storage sockaddr_of(const UdpAddress& address) {
    sockaddr_storage result{};
    std::memcpy(&result, address.bytes.data(), address.length_bytes);
    return result;
}

UdpAddress address_of(const sockaddr_storage& raw, std::size_t length) {
    UdpAddress result;
    if (length == 0 || length > result.bytes.size()) return result;
    std::memcpy(result.bytes.data(), &raw, length);
    result.length_bytes = static_cast<std::uint32_t>(length);
    return result;
}

sa_family_t family_of(const UdpAddress& address) {
    return sockaddr_of(address).ss_family;
}

const sockaddr* generic(const sockaddr_storage& raw) {
    return reinterpret_cast<const sockaddr*>(&raw);
}

sockaddr* generic(sockaddr_storage& raw) {
    return reinterpret_cast<sockaddr*>(&raw);
}

}  // namespace

Result<UdpAddress, LinkError> resolve_udp(const std::string& host, std::uint16_t port) {
    addrinfo wanted{};
    wanted.ai_family = AF_UNSPEC;
    wanted.ai_socktype = SOCK_DGRAM;
    wanted.ai_flags = AI_NUMERICSERV | AI_PASSIVE;
    addrinfo* found = nullptr;
    const std::string service = std::to_string(port);
    if (getaddrinfo(host.empty() ? nullptr : host.c_str(), service.c_str(), &wanted, &found) != 0) {
        return failure(LinkError::kOpen);
    }
    sockaddr_storage raw{};
    const std::size_t length = found->ai_addrlen;
    if (length <= sizeof(raw)) std::memcpy(&raw, found->ai_addr, length);
    freeaddrinfo(found);
    const UdpAddress address = address_of(raw, length);
    if (address.empty()) return failure(LinkError::kOpen);
    return address;
}

Result<void, LinkError> UdpLink::open() {
    close();
    const int family = !fixed_peer_.empty() ? family_of(fixed_peer_)
                       : !local_.empty()    ? family_of(local_)
                                            : AF_INET;
    const os::SystemResult made =
        os::system_call([&] { return ::socket(family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0); });
    if (!made.done()) return failure(LinkError::kOpen);
    os::Descriptor socket(static_cast<int>(made.value));
    if (!local_.empty()) {
        const sockaddr_storage raw = sockaddr_of(local_);
        const bool bound =
            os::system_call([&] { return bind(socket.get(), generic(raw), local_.length_bytes); }).done();
        if (!bound) return failure(LinkError::kOpen);
    }
    if (!fixed_peer_.empty()) {
        const sockaddr_storage raw = sockaddr_of(fixed_peer_);
        const bool connected = os::system_call([&] {
                                   return connect(socket.get(), generic(raw), fixed_peer_.length_bytes);
                               }).done();
        if (!connected) return failure(LinkError::kOpen);
    }
    socket_ = std::move(socket);
    return {};
}

void UdpLink::close() {
    socket_.reset();
    heard_ = {};
}

Result<std::size_t, LinkError> UdpLink::write(ByteSpan bytes) {
    if (!socket_.is_open()) return failure(LinkError::kClosed);
    if (bytes.empty() || (fixed_peer_.empty() && heard_.empty())) return std::size_t{0};
    const sockaddr_storage raw = sockaddr_of(heard_);
    const sockaddr* peer = fixed_peer_.empty() ? generic(raw) : nullptr;
    const socklen_t peer_length = fixed_peer_.empty() ? heard_.length_bytes : 0;
    const os::SystemResult sent = os::system_call(
        [&] { return sendto(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL, peer, peer_length); },
        {EAGAIN, ECONNREFUSED, ENETUNREACH, EHOSTUNREACH, ENETDOWN, EHOSTDOWN, ENOBUFS, EPERM});
    if (sent.tolerated()) return std::size_t{0};
    if (sent.failed()) return failure(LinkError::kIo);
    return static_cast<std::size_t>(sent.value);
}

Result<std::size_t, LinkError> UdpLink::read(MutableByteSpan into) {
    if (!socket_.is_open()) return failure(LinkError::kClosed);
    if (into.empty()) return std::size_t{0};
    for (int attempt = 0; attempt < kDatagramsPerRead; ++attempt) {
        sockaddr_storage sender{};
        socklen_t sender_length = sizeof(sender);
        const os::SystemResult got = os::system_call(
            [&] {
                return recvfrom(socket_.get(), into.data(), into.size(), MSG_TRUNC, generic(sender),
                                &sender_length);
            },
            {EAGAIN, ECONNREFUSED, ENETUNREACH, EHOSTUNREACH, ENETDOWN, EHOSTDOWN});
        // A pending ICMP report is taken away by the call that returned it; datagrams may wait behind it.
        if (got.tolerated() && got.error_number != EAGAIN) continue;
        if (got.tolerated()) return std::size_t{0};
        if (got.failed()) return failure(LinkError::kIo);
        if (static_cast<std::size_t>(got.value) > into.size()) {
            ++oversized_datagrams_;
            continue;
        }
        if (fixed_peer_.empty()) heard_ = address_of(sender, sender_length);
        if (got.value == 0) continue;
        return static_cast<std::size_t>(got.value);
    }
    return std::size_t{0};
}

std::uint16_t UdpLink::local_port() const {
    if (!socket_.is_open()) return 0;
    sockaddr_storage raw{};
    socklen_t length = sizeof(raw);
    if (!os::system_call([&] { return getsockname(socket_.get(), generic(raw), &length); }).done()) return 0;
    std::uint16_t port = 0;  // at the same offset in sockaddr_in and sockaddr_in6
    std::memcpy(&port, reinterpret_cast<const std::byte*>(&raw) + offsetof(sockaddr_in, sin_port),
                sizeof(port));
    return ntohs(port);
}

}  // namespace rig
