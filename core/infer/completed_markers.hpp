// What inference hands on: a position for every marker of the layout.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/linalg.hpp"
#include "core/limits.hpp"

namespace rig {

struct InferenceOutput {
    std::uint16_t count = 0;
    std::uint16_t inferred = 0;
    std::array<Vec3, kMaxMarkers> position_mm{};  // face frame: measured where seen, inferred elsewhere
};

}  // namespace rig
