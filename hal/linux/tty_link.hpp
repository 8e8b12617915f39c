// A serial port: UART, USB CDC-ACM gadget or adapter.
#pragma once

#include <string>

#include "hal/byte_link.hpp"
#include "hal/linux/descriptor.hpp"

namespace rig {

// Any rate the driver can divide; 115200 to 3000000 baud are what the rig uses. EIO, ENODEV, ENXIO and
// hang-up become kClosed: the device went away and open() tries again.
class TtyLink final : public ByteLink {
  public:
    TtyLink(std::string path, int baud) : path_(std::move(path)), baud_(baud) {}
    [[nodiscard]] Result<void, LinkError> open() override;
    void close() override { port_.reset(); }
    [[nodiscard]] Result<std::size_t, LinkError> write(ByteSpan bytes) override;
    [[nodiscard]] Result<std::size_t, LinkError> read(MutableByteSpan into) override;
    [[nodiscard]] bool is_datagram() const override { return false; }

  private:
    [[nodiscard]] LinkError lost(int error_number);

    std::string path_;
    int baud_;
    os::Descriptor port_;
};

}  // namespace rig
