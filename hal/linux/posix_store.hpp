// Persistent bytes in one file of fixed size.
#pragma once

#include <string>

#include "hal/linux/descriptor.hpp"
#include "hal/store.hpp"

namespace rig {

// After a sync() that failed the kernel may have dropped the changes and forgotten that it did, so every
// later call is kIo until open() has read the truth from the disk again.
class PosixStore final : public Store {
  public:
    PosixStore(std::string path, std::size_t size_bytes) : path_(std::move(path)), size_bytes_(size_bytes) {}

    // Creates the file, all 0xFF, if there is none: written beside it, synced, renamed and the folder synced,
    // so that a power cut leaves either no file or a whole one. kOpen when a file of another size is there.
    [[nodiscard]] Result<void, StoreError> open();
    void close() { file_.reset(); }

    [[nodiscard]] std::size_t size_bytes() const override { return size_bytes_; }
    [[nodiscard]] Result<void, StoreError> read(std::size_t offset, MutableByteSpan into) override;
    [[nodiscard]] Result<void, StoreError> erase(std::size_t offset, std::size_t length) override;
    [[nodiscard]] Result<void, StoreError> program(std::size_t offset, ByteSpan bytes) override;
    [[nodiscard]] Result<void, StoreError> sync() override;

  private:
    [[nodiscard]] Result<void, StoreError> create() const;
    [[nodiscard]] Result<void, StoreError> check_range(std::size_t offset, std::size_t length) const;

    std::string path_;
    std::size_t size_bytes_;
    os::Descriptor file_;
    bool sync_failed_ = false;
};

}  // namespace rig
