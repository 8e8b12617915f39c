// A serial line that damages bytes, and knows which frames it damaged.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/bytes.hpp"
#include "tests/support/random.hpp"

namespace rig::test {

struct ChannelRates {
    double bit_error = 0.0;    // per bit
    double byte_drop = 0.0;    // per byte
    double byte_insert = 0.0;  // per byte: one random byte before it
};

struct ChannelCounters {
    std::uint64_t bytes = 0;
    std::uint64_t flipped_bits = 0;
    std::uint64_t dropped = 0;
    std::uint64_t inserted = 0;
};

class NoisyChannel {
  public:
    NoisyChannel(const ChannelRates& rates, std::uint64_t seed);

    // Appends what arrives of `frame` to `line`. True when its own bytes arrived intact: none flipped or
    // dropped, none inserted between its first and last.
    [[nodiscard]] bool send(ByteSpan frame, std::vector<std::byte>& line);
    [[nodiscard]] const ChannelCounters& counters() const { return counters_; }

  private:
    // Trials until the next event of a probability: geometric, so that quiet stretches cost nothing.
    [[nodiscard]] std::uint64_t gap(double probability);

    ChannelRates rates_;
    SeededRandom random_;
    std::uint64_t bits_to_flip_;
    std::uint64_t bytes_to_drop_;
    std::uint64_t bytes_to_insert_;
    ChannelCounters counters_;
};

}  // namespace rig::test
