// The last check before a state is encoded (clause C1 of the output contract): finite and inside the declared
// ranges, whatever was computed.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/face_state.hpp"

namespace rig {

class OutputGate {
  public:
    // The ranges of the pack; equal lengths. Without a pack nothing has a weight.
    void configure(std::span<const float> low, std::span<const float> high);
    // A number that is not finite becomes the one sent last, one outside its range the range's end; both
    // raise kSolveWeak. Returns how many numbers were changed.
    std::uint32_t pass(FaceState& state);

  private:
    std::span<const float> low_;
    std::span<const float> high_;
    std::array<float, kMaxShapes> held_{};
};

}  // namespace rig
