// A way for bytes to the host and back. Streams (serial) may split and join writes; datagram links keep each
// write whole. The framing above works on both.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/bytes.hpp"
#include "core/base/result.hpp"

namespace rig {

enum class LinkError : std::uint8_t {
    kClosed,  // the other side or the device is gone; open() again
    kIo,      // the transfer failed
    kOpen,    // could not be opened
};

// Contract. Nothing blocks. write() takes a prefix of the bytes and returns its length, 0 when the other side
// does not read; a datagram link takes all or nothing. read() returns how many bytes it put at the start of
// `into`, 0 when none are there. kClosed is sticky until open(). open() on an open link closes it first. No
// call but open() allocates. One thread uses a link.
class ByteLink {
  public:
    virtual ~ByteLink() = default;
    [[nodiscard]] virtual Result<void, LinkError> open() = 0;
    virtual void close() = 0;
    [[nodiscard]] virtual Result<std::size_t, LinkError> write(ByteSpan bytes) = 0;
    [[nodiscard]] virtual Result<std::size_t, LinkError> read(MutableByteSpan into) = 0;
    [[nodiscard]] virtual bool is_datagram() const = 0;
};

}  // namespace rig
