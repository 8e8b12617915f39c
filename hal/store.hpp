// Persistent bytes. Every change is one of three numbered operations, so that a harness can cut the power at
// each.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/bytes.hpp"
#include "core/base/result.hpp"

namespace rig {

enum class StoreError : std::uint8_t { kIo, kOutOfRange, kNoSpace, kOpen };

// A region of size_bytes(), initially all 0xFF. Contract: read() returns the last programmed bytes; program()
// changes exactly its range; erase() sets its range to 0xFF; what was changed before a sync() that succeeded
// survives a power cut, what was changed after it may be there wholly, partly or not at all. One thread uses
// a store.
class Store {
  public:
    virtual ~Store() = default;
    [[nodiscard]] virtual std::size_t size_bytes() const = 0;
    [[nodiscard]] virtual Result<void, StoreError> read(std::size_t offset, MutableByteSpan into) = 0;
    [[nodiscard]] virtual Result<void, StoreError> erase(std::size_t offset, std::size_t length) = 0;
    [[nodiscard]] virtual Result<void, StoreError> program(std::size_t offset, ByteSpan bytes) = 0;
    [[nodiscard]] virtual Result<void, StoreError> sync() = 0;
};

}  // namespace rig
