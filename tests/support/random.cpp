#include "tests/support/random.hpp"

namespace rig::test {

std::uint64_t SeededRandom::bits() {
    state_ += 0x9e3779b97f4a7c15ULL;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
}

double SeededRandom::uniform(double low, double high) {
    const double unit = static_cast<double>(bits() >> 11) * 0x1p-53;
    return low + (high - low) * unit;
}

double SeededRandom::normal(double mean, double deviation) {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += uniform(0.0, 1.0);
    return mean + deviation * sum;
}

std::uint64_t SeededRandom::below(std::uint64_t count) {
    return bits() % count;
}

bool SeededRandom::chance(double probability) {
    return uniform(0.0, 1.0) < probability;
}

}  // namespace rig::test
