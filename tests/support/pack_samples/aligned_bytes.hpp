// Bytes at a 64-byte boundary and exactly as long as they are, so that a sanitizer sees any read past the
// end.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "core/pack/pack_format.hpp"

namespace rig::test {

class AlignedBytes {
  public:
    explicit AlignedBytes(ByteSpan bytes)
        : storage_(allocate(bytes.size()), &std::free), size_(bytes.size()) {
        if (size_ > 0) std::memcpy(storage_.get(), bytes.data(), size_);
    }
    [[nodiscard]] ByteSpan span() const { return {storage_.get(), size_}; }
    [[nodiscard]] MutableByteSpan mutable_span() { return {storage_.get(), size_}; }
    [[nodiscard]] std::byte& operator[](std::size_t i) { return storage_.get()[i]; }

  private:
    static std::byte* allocate(std::size_t size) {
        void* start = nullptr;
        RIG_CHECK(::posix_memalign(&start, kPackAlignment, std::max<std::size_t>(size, 1)) == 0);
        return static_cast<std::byte*>(start);
    }

    std::unique_ptr<std::byte, void (*)(void*)> storage_;
    std::size_t size_;
};

}  // namespace rig::test
