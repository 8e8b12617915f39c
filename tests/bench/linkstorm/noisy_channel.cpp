#include "tests/bench/linkstorm/noisy_channel.hpp"

#include <algorithm>
#include <cmath>

namespace rig::test {

NoisyChannel::NoisyChannel(const ChannelRates& rates, std::uint64_t seed) : rates_(rates), random_(seed) {
    bits_to_flip_ = gap(rates_.bit_error);
    bytes_to_drop_ = gap(rates_.byte_drop);
    bytes_to_insert_ = gap(rates_.byte_insert);
}

std::uint64_t NoisyChannel::gap(double probability) {
    if (probability <= 0.0) return ~std::uint64_t{0};
    if (probability >= 1.0) return 0;
    const double uniform = 1.0 - random_.uniform(0.0, 1.0);  // (0, 1]
    return static_cast<std::uint64_t>(std::min(std::log(uniform) / std::log1p(-probability), 1.0e18));
}

bool NoisyChannel::send(ByteSpan frame, std::vector<std::byte>& line) {
    bool intact = true;
    for (std::size_t i = 0; i < frame.size(); ++i) {
        ++counters_.bytes;
        if (bytes_to_insert_-- == 0) {
            bytes_to_insert_ = gap(rates_.byte_insert);
            line.push_back(static_cast<std::byte>(random_.bits()));
            ++counters_.inserted;
            if (i > 0) intact = false;
        }
        std::byte byte = frame[i];
        while (bits_to_flip_ < 8) {
            byte ^= static_cast<std::byte>(1U << bits_to_flip_);
            bits_to_flip_ += 1 + gap(rates_.bit_error);
            ++counters_.flipped_bits;
            intact = false;
        }
        bits_to_flip_ -= 8;
        if (bytes_to_drop_-- == 0) {
            bytes_to_drop_ = gap(rates_.byte_drop);
            ++counters_.dropped;
            intact = false;
            continue;
        }
        line.push_back(byte);
    }
    return intact;
}

}  // namespace rig::test
