// Repeatable white noise for training and experiments: the same sequence from the same seed on every machine.
#pragma once

#include <cstdint>

namespace rig::host {

// Mean 0, standard deviation 1, tails that end at 6: SplitMix64 and the sum of twelve uniforms.
class WhiteNoise {
  public:
    explicit WhiteNoise(std::uint64_t seed) : state_(seed) {}

    double next() {
        double sum = -6.0;
        for (int i = 0; i < 12; ++i) sum += uniform();
        return sum;
    }
    // [0, 1)
    double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }

  private:
    std::uint64_t bits() {
        state_ += 0x9e3779b97f4a7c15ULL;
        std::uint64_t z = state_;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
        return z ^ (z >> 31);
    }
    std::uint64_t state_;
};

}  // namespace rig::host
