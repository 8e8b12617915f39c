// A vector whose storage is inside it. Pushing beyond the capacity is refused and reported to the caller.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <utility>

#include "core/base/check.hpp"

namespace rig {

// Elements [0, size()) are valid. T is trivially destructible; unused elements stay default-constructed.
template <class T, std::size_t kCapacity>
class BoundedVector {
  public:
    [[nodiscard]] static constexpr std::size_t capacity() { return kCapacity; }
    [[nodiscard]] constexpr std::size_t size() const { return size_; }
    [[nodiscard]] constexpr bool empty() const { return size_ == 0; }
    [[nodiscard]] constexpr bool full() const { return size_ == kCapacity; }
    constexpr void clear() { size_ = 0; }

    // False, and no change, when full.
    [[nodiscard]] constexpr bool push_back(const T& value) {
        if (full()) return false;
        items_[size_++] = value;
        return true;
    }
    constexpr void pop_back() {
        RIG_CHECK(size_ > 0);
        --size_;
    }
    constexpr void resize(std::size_t size) {
        RIG_CHECK(size <= kCapacity);
        size_ = size;
    }

    [[nodiscard]] constexpr T& operator[](std::size_t i) {
        RIG_CHECK(i < size_);
        return items_[i];
    }
    [[nodiscard]] constexpr const T& operator[](std::size_t i) const {
        RIG_CHECK(i < size_);
        return items_[i];
    }
    [[nodiscard]] constexpr T* begin() { return items_.data(); }
    [[nodiscard]] constexpr T* end() { return items_.data() + size_; }
    [[nodiscard]] constexpr const T* begin() const { return items_.data(); }
    [[nodiscard]] constexpr const T* end() const { return items_.data() + size_; }
    [[nodiscard]] constexpr std::span<T> span() { return {items_.data(), size_}; }
    [[nodiscard]] constexpr std::span<const T> span() const { return {items_.data(), size_}; }

  private:
    std::array<T, kCapacity> items_{};
    std::size_t size_ = 0;
};

// Keeps `items` in falling order of value_of(item), of equals the older ones first; without room the last one
// falls out. False when that is the new one.
template <class T, std::size_t kCapacity, class ValueOf>
bool keep_best(BoundedVector<T, kCapacity>& items, const T& item, ValueOf value_of) {
    if (items.full()) {
        if (!(value_of(items[items.size() - 1]) < value_of(item))) return false;
        items.pop_back();
    }
    if (!items.push_back(item)) return false;
    for (std::size_t i = items.size() - 1; i > 0 && value_of(items[i - 1]) < value_of(items[i]); --i)
        std::swap(items[i - 1], items[i]);
    return true;
}

}  // namespace rig
