#include "firmware_host/companion/world/shared_images.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace rig::host {

namespace {

std::unexpected<FileError> system_failure(const std::filesystem::path& file, const char* doing) {
    return file_failure(file, std::string(doing) + ": " + std::strerror(errno));
}

// True when a connection succeeds: somebody lives there.
bool is_answered(const sockaddr_un& address) {
    const Descriptor probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    return probe.get() >= 0 &&
           ::connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
}

}  // namespace

Descriptor::~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
}

Result<SharedImages, FileError> SharedImages::create(std::size_t bytes) {
    Descriptor fd(::memfd_create("rig-world", MFD_CLOEXEC | MFD_ALLOW_SEALING));
    if (fd.get() < 0) return system_failure("shared memory", "memfd_create");
    if (::ftruncate(fd.get(), static_cast<off_t>(bytes)) != 0)
        return system_failure("shared memory", "cannot be sized");
    if (::fcntl(fd.get(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0) {
        return system_failure("shared memory", "cannot be sealed");
    }
    void* data = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd.get(), 0);
    if (data == MAP_FAILED) return system_failure("shared memory", "cannot be mapped");
    return SharedImages(std::move(fd), static_cast<std::uint8_t*>(data), bytes);
}

SharedImages::SharedImages(SharedImages&& other) noexcept
    : fd_(std::move(other.fd_)),
      data_(std::exchange(other.data_, nullptr)),
      size_(std::exchange(other.size_, 0)) {}

SharedImages::~SharedImages() {
    if (data_ != nullptr) ::munmap(data_, size_);
}

Result<Descriptor, FileError> listen_at(const std::filesystem::path& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string name = path.string();
    if (name.empty() || name.size() >= sizeof(address.sun_path)) {
        return file_failure(path,
                            "a socket path has 1 to 107 bytes; use a shorter one, for example under /tmp");
    }
    std::memcpy(address.sun_path, name.c_str(), name.size() + 1);
    struct stat found{};
    if (::lstat(name.c_str(), &found) == 0) {
        if (!S_ISSOCK(found.st_mode)) return file_failure(path, "is there and is not a socket");
        if (is_answered(address)) return file_failure(path, "another world is serving here");
        ::unlink(name.c_str());
    }
    Descriptor fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (fd.get() < 0) return system_failure(path, "socket");
    if (::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
        return system_failure(path, "cannot be bound");
    }
    if (::listen(fd.get(), 1) != 0) return system_failure(path, "cannot listen");
    return fd;
}

bool send_all(int socket, std::span<const std::byte> bytes, int descriptor) {
    while (!bytes.empty()) {
        iovec part{const_cast<std::byte*>(bytes.data()), bytes.size()};
        msghdr message{};
        message.msg_iov = &part;
        message.msg_iovlen = 1;
        alignas(cmsghdr) char ancillary[CMSG_SPACE(sizeof(int))] = {};
        if (descriptor >= 0) {
            message.msg_control = ancillary;
            message.msg_controllen = sizeof(ancillary);
            cmsghdr* header = CMSG_FIRSTHDR(&message);
            header->cmsg_level = SOL_SOCKET;
            header->cmsg_type = SCM_RIGHTS;
            header->cmsg_len = CMSG_LEN(sizeof(int));
            std::memcpy(CMSG_DATA(header), &descriptor, sizeof(int));
        }
        const ssize_t sent = ::sendmsg(socket, &message, MSG_NOSIGNAL);
        if (sent < 0) {
            if (errno == EINTR) continue;
            if (errno != EAGAIN && errno != EWOULDBLOCK) return false;
            pollfd ready{socket, POLLOUT, 0};
            if (::poll(&ready, 1, 1000) <= 0)
                return false;  // a daemon that has not read for a second is gone
            continue;
        }
        descriptor = -1;
        bytes = bytes.subspan(static_cast<std::size_t>(sent));
    }
    return true;
}

}  // namespace rig::host
