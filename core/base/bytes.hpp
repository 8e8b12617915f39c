// Little-endian loads and stores on byte spans, and a cursor that cannot run past the end.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

#include "core/base/check.hpp"

namespace rig {

using ByteSpan = std::span<const std::byte>;
using MutableByteSpan = std::span<std::byte>;

static_assert(std::endian::native == std::endian::little, "both boards and hosts are little-endian");

// Precondition: offset + sizeof(T) <= bytes.size().
template <class T>
    requires std::is_trivially_copyable_v<T>
[[nodiscard]] T load(ByteSpan bytes, std::size_t offset) {
    RIG_CHECK(offset <= bytes.size() && sizeof(T) <= bytes.size() - offset);
    T value;
    std::memcpy(&value, bytes.data() + offset, sizeof(T));
    return value;
}

template <class T>
    requires std::is_trivially_copyable_v<T>
void store(MutableByteSpan bytes, std::size_t offset, const T& value) {
    RIG_CHECK(offset <= bytes.size() && sizeof(T) <= bytes.size() - offset);
    std::memcpy(bytes.data() + offset, &value, sizeof(T));
}

// Reads a message field by field. A read past the end yields zero and makes ok() false for good.
class ByteReader {
  public:
    explicit ByteReader(ByteSpan bytes) : bytes_(bytes) {}

    template <class T>
        requires std::is_trivially_copyable_v<T>
    [[nodiscard]] T read() {
        if (!ok_ || sizeof(T) > bytes_.size() - position_) {
            ok_ = false;
            return T{};
        }
        const T value = load<T>(bytes_, position_);
        position_ += sizeof(T);
        return value;
    }
    [[nodiscard]] ByteSpan read_bytes(std::size_t count) {
        if (!ok_ || count > bytes_.size() - position_) {
            ok_ = false;
            return {};
        }
        const ByteSpan part = bytes_.subspan(position_, count);
        position_ += count;
        return part;
    }
    [[nodiscard]] bool ok() const { return ok_; }
    [[nodiscard]] std::size_t remaining() const { return bytes_.size() - position_; }

  private:
    ByteSpan bytes_;
    std::size_t position_ = 0;
    bool ok_ = true;
};

// Writes a message field by field. A write past the end writes nothing and makes ok() false for good.
class ByteWriter {
  public:
    explicit ByteWriter(MutableByteSpan bytes) : bytes_(bytes) {}

    template <class T>
        requires std::is_trivially_copyable_v<T>
    void write(const T& value) {
        if (!ok_ || sizeof(T) > bytes_.size() - position_) {
            ok_ = false;
            return;
        }
        store(bytes_, position_, value);
        position_ += sizeof(T);
    }
    void write_bytes(ByteSpan part) {
        if (!ok_ || part.size() > bytes_.size() - position_) {
            ok_ = false;
            return;
        }
        if (!part.empty()) std::memcpy(bytes_.data() + position_, part.data(), part.size());
        position_ += part.size();
    }
    [[nodiscard]] bool ok() const { return ok_; }
    [[nodiscard]] std::size_t size() const { return position_; }
    [[nodiscard]] MutableByteSpan written() const { return bytes_.first(position_); }

  private:
    MutableByteSpan bytes_;
    std::size_t position_ = 0;
    bool ok_ = true;
};

}  // namespace rig
