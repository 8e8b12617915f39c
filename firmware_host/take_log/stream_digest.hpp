// One number for a whole run of the solver: equal when every tick had the same state, weights and confidences
// as they are encoded. Two runs, two builds and a replayed observation log are compared by it.
#pragma once

#include <cstdint>

#include "core/base/face_state.hpp"

namespace rig {

// FNV-1a, 64 bit, over the weights payloads of core/wire with age and faults zero: age depends on the link,
// and some faults on what only the images show.
class StreamDigest {
  public:
    void add(const FaceState& state);
    [[nodiscard]] std::uint64_t value() const { return value_; }
    [[nodiscard]] std::uint64_t ticks() const { return ticks_; }

  private:
    std::uint64_t value_ = 14695981039346656037ULL;
    std::uint64_t ticks_ = 0;
};

}  // namespace rig
