// Random numbers for tests: the same sequence from the same seed on every machine and library.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace rig::test {

// SplitMix64 (Steele, Lea, Flood 2014). Cheap to copy; a copy continues the same sequence.
class SeededRandom {
  public:
    explicit SeededRandom(std::uint64_t seed) : state_(seed) {}

    [[nodiscard]] std::uint64_t bits();
    [[nodiscard]] double uniform(double low, double high);  // [low, high)
    [[nodiscard]] double normal(double mean,
                                double deviation);  // sum of twelve uniforms: tails end at 6 deviations
    [[nodiscard]] std::uint64_t below(std::uint64_t count);  // 0 .. count - 1; count >= 1
    [[nodiscard]] bool chance(double probability);

    // Fisher-Yates.
    template <class T>
    void shuffle(std::span<T> items) {
        for (std::size_t i = items.size(); i > 1; --i) {
            const std::size_t j = below(i);
            const T kept = items[i - 1];
            items[i - 1] = items[j];
            items[j] = kept;
        }
    }

  private:
    std::uint64_t state_;
};

}  // namespace rig::test
