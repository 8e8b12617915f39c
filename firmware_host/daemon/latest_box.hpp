// Hands the newest value of one thread to another without waiting: three copies, one being written, one being
// read, one in between.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace rig {

// One writer, one reader. The writer fills back() and publishes it; the reader gets the newest published
// value. Values that were replaced before the reader came are lost, and the writer learns of it.
template <class T>
class LatestBox {
  public:
    [[nodiscard]] T& back() { return values_[back_]; }
    // True when the value before was never read.
    bool publish() {
        const std::uint8_t old =
            middle_.exchange(static_cast<std::uint8_t>(back_ | kFresh), std::memory_order_acq_rel);
        back_ = old & kIndex;
        return (old & kFresh) != 0;
    }
    // nullptr when nothing new was published; otherwise the newest, valid until the next call.
    [[nodiscard]] T* take() {
        if ((middle_.load(std::memory_order_acquire) & kFresh) == 0) return nullptr;
        const std::uint8_t old = middle_.exchange(front_, std::memory_order_acq_rel);
        front_ = old & kIndex;
        return &values_[front_];
    }
    [[nodiscard]] bool fresh() const { return (middle_.load(std::memory_order_acquire) & kFresh) != 0; }
    // Before any thread runs: to size what the values hold.
    [[nodiscard]] std::array<T, 3>& values() { return values_; }

  private:
    static constexpr std::uint8_t kIndex = 3;
    static constexpr std::uint8_t kFresh = 4;
    std::array<T, 3> values_{};
    std::uint8_t back_ = 0;
    std::uint8_t front_ = 1;
    std::atomic<std::uint8_t> middle_{2};
};

}  // namespace rig
