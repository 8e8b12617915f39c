// The shared memory of the world boundary, and the sockets that pass it on. Thin over memfd_create, mmap and
// sendmsg.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

#include "core/base/result.hpp"
#include "firmware_host/companion/files/file_error.hpp"

namespace rig::host {

// A file descriptor that closes itself; -1 is none.
class Descriptor {
  public:
    explicit Descriptor(int fd = -1) : fd_(fd) {}
    ~Descriptor();
    Descriptor(Descriptor&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
    Descriptor& operator=(Descriptor&& other) noexcept;
    [[nodiscard]] int get() const { return fd_; }
    // Gives up ownership.
    [[nodiscard]] int release() {
        const int fd = fd_;
        fd_ = -1;
        return fd;
    }

  private:
    int fd_;
};

// Anonymous memory with a descriptor that another process can map; its size cannot change any more.
class SharedImages {
  public:
    [[nodiscard]] static Result<SharedImages, FileError> create(std::size_t bytes);
    ~SharedImages();
    SharedImages(SharedImages&& other) noexcept;
    SharedImages& operator=(SharedImages&&) = delete;
    [[nodiscard]] std::span<std::uint8_t> bytes() const { return {data_, size_}; }
    [[nodiscard]] int descriptor() const { return fd_.get(); }

  private:
    SharedImages(Descriptor fd, std::uint8_t* data, std::size_t size)
        : fd_(std::move(fd)), data_(data), size_(size) {}
    Descriptor fd_;
    std::uint8_t* data_;
    std::size_t size_;
};

// A listening Unix stream socket at `path`. Refuses: a path longer than a socket address holds, a file there
// that is no socket or that somebody listens on.
[[nodiscard]] Result<Descriptor, FileError> listen_at(const std::filesystem::path& path);

// All bytes, with `descriptor` as ancillary data unless it is -1. False when the peer is gone.
[[nodiscard]] bool send_all(int socket, std::span<const std::byte> bytes, int descriptor = -1);

}  // namespace rig::host
