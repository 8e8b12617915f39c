// A pseudo-terminal: a serial port without hardware. The other side opens the slave, by its own name or by a
// symlink.
#pragma once

#include <array>
#include <string>

#include "hal/byte_link.hpp"
#include "hal/linux/descriptor.hpp"

namespace rig {

// The slave may be opened late, closed and opened again; this link stays. While nobody has it open, write()
// takes 0 bytes (a reader that comes later shall not find old bytes) and read() hands out what the last
// reader still wrote, then 0. Bytes that a reader left unread are dropped as soon as write() or read()
// notices that it has gone. The link is never kClosed by what readers do.
class PtyLink final : public ByteLink {
  public:
    // `symlink_path` may be empty. An existing symlink there is replaced; anything else there refuses open().
    explicit PtyLink(std::string symlink_path) : symlink_path_(std::move(symlink_path)) {}
    ~PtyLink() override { close(); }
    PtyLink(const PtyLink&) = delete;
    PtyLink& operator=(const PtyLink&) = delete;
    [[nodiscard]] Result<void, LinkError> open() override;
    // Gives a reader that is there up to 0.3 s to take what was written: closing would destroy it. Then
    // removes the symlink if it is still this link's.
    void close() override;
    [[nodiscard]] Result<std::size_t, LinkError> write(ByteSpan bytes) override;
    [[nodiscard]] Result<std::size_t, LinkError> read(MutableByteSpan into) override;
    [[nodiscard]] bool is_datagram() const override { return false; }
    // The slave's device name, "" when not open.
    [[nodiscard]] const char* slave_path() const { return slave_path_.data(); }

  private:
    [[nodiscard]] bool slave_is_open();
    void let_reader_finish();
    [[nodiscard]] bool open_pair();
    [[nodiscard]] bool discard_leftovers() const;
    [[nodiscard]] bool publish_symlink() const;
    [[nodiscard]] bool owns_symlink() const;

    std::string symlink_path_;
    os::Descriptor master_;
    std::array<char, 64> slave_path_{};
    bool leftovers_possible_ = false;
};

}  // namespace rig
