#include "tests/unit/firmware_host/companion/world/world_visitor.hpp"

#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>

namespace rig::test {

WorldVisitor::WorldVisitor(const std::filesystem::path& socket) : socket_(::socket(AF_UNIX, SOCK_STREAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, socket.c_str(), sizeof(address.sun_path) - 1);
    if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) return;
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
    iovec part{&hello_, sizeof(hello_)};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control;
    message.msg_controllen = sizeof(control);
    if (::recvmsg(socket_, &message, MSG_WAITALL) != static_cast<ssize_t>(sizeof(hello_))) return;
    const cmsghdr* header = CMSG_FIRSTHDR(&message);
    if (header == nullptr || header->cmsg_type != SCM_RIGHTS) return;
    int memory = -1;
    std::memcpy(&memory, CMSG_DATA(header), sizeof(memory));
    void* mapped = ::mmap(nullptr, hello_.memory_bytes, PROT_READ, MAP_SHARED, memory, 0);
    ::close(memory);
    if (mapped != MAP_FAILED) images_ = static_cast<const std::uint8_t*>(mapped);
}

WorldVisitor::~WorldVisitor() {
    hang_up();
    if (images_ != nullptr) ::munmap(const_cast<std::uint8_t*>(images_), hello_.memory_bytes);
}

void WorldVisitor::hang_up() {
    if (socket_ >= 0) ::close(socket_);
    socket_ = -1;
}

std::optional<sim::WorldMessage> WorldVisitor::next(int timeout_ms) {
    pollfd ready{socket_, POLLIN, 0};
    if (::poll(&ready, 1, timeout_ms) <= 0) return std::nullopt;
    sim::WorldMessage message;
    if (::recv(socket_, &message, sizeof(message), MSG_WAITALL) != static_cast<ssize_t>(sizeof(message)))
        return std::nullopt;
    return message;
}

void WorldVisitor::say(const sim::WorldMessage& message) {
    static_cast<void>(::send(socket_, &message, sizeof(message), MSG_NOSIGNAL));
}

void WorldVisitor::say(sim::WorldMessageKind kind, std::uint32_t slot, std::uint32_t sequence) {
    sim::WorldMessage message;
    message.kind = kind;
    message.slot = slot;
    message.sequence = sequence;
    say(message);
}

std::span<const std::uint8_t> WorldVisitor::image(std::uint32_t slot, std::size_t camera) const {
    const std::size_t index = static_cast<std::size_t>(slot) * hello_.camera_count + camera;
    return {images_ + hello_.image_offset + index * hello_.image_stride_bytes,
            static_cast<std::size_t>(hello_.width_px) * hello_.height_px};
}

}  // namespace rig::test
