// What inference hands on: a position for every marker of the layout, and how well it is known.
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
    // 1 measured, 0 nothing known beyond the face's usual spread; between: 1 - deviation / usual deviation.
    // Hiding any marker raises none.
    std::array<float, kMaxMarkers> confidence{};
    // Expected distance of an inferred marker from where it is (rms); 0 for measured ones, whose noise is the
    // measurement's business.
    std::array<float, kMaxMarkers> deviation_mm{};
};

}  // namespace rig
