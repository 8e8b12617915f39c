// A digest for comparing runs bit by bit (FNV-1a, 64 bits). Not for guarding against anybody: for equal or
// not equal.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace rig::test {

class Digest {
  public:
    Digest& add_bytes(std::span<const std::byte> bytes);
    // Types without padding only: padding bytes are not part of a value.
    template <class T>
        requires std::is_arithmetic_v<T> || std::is_enum_v<T>
    Digest& add(const T& value) {
        return add_bytes(std::as_bytes(std::span<const T>(&value, 1)));
    }
    template <class T>
        requires std::is_arithmetic_v<T>
    Digest& add(std::span<const T> values) {
        return add_bytes(std::as_bytes(values));
    }
    [[nodiscard]] std::uint64_t value() const { return value_; }

  private:
    std::uint64_t value_ = 14695981039346656037ULL;  // FNV offset basis
};

}  // namespace rig::test
