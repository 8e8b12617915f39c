// A first-in first-out queue whose storage is inside it.
#pragma once

#include <array>
#include <cstddef>

#include "core/base/check.hpp"

namespace rig {

// One thread, or a lock of the owner's. Pushing beyond the capacity is refused and reported to the caller.
template <class T, std::size_t kCapacity>
class Ring {
  public:
    [[nodiscard]] std::size_t size() const { return size_; }
    [[nodiscard]] bool empty() const { return size_ == 0; }
    [[nodiscard]] bool full() const { return size_ == kCapacity; }
    void clear() { first_ = size_ = 0; }

    // False, and no change, when full.
    [[nodiscard]] bool push_back(const T& value) {
        if (full()) return false;
        items_[(first_ + size_) % kCapacity] = value;
        ++size_;
        return true;
    }
    [[nodiscard]] T pop_front() {
        RIG_CHECK(size_ > 0);
        const T value = items_[first_];
        first_ = (first_ + 1) % kCapacity;
        --size_;
        return value;
    }
    [[nodiscard]] T& front() {
        RIG_CHECK(size_ > 0);
        return items_[first_];
    }
    [[nodiscard]] const T& front() const {
        RIG_CHECK(size_ > 0);
        return items_[first_];
    }

  private:
    std::array<T, kCapacity> items_{};
    std::size_t first_ = 0;
    std::size_t size_ = 0;
};

}  // namespace rig
