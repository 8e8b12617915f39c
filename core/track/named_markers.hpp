// What tracking hands on: markers with names, positions and how well each is known.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/linalg.hpp"
#include "core/limits.hpp"

namespace rig {

struct NamedMarker {
    bool seen = false;
    std::uint8_t views = 0;           // cameras that saw it; 0 for 3D input streams
    Vec3 position_mm = Vec3::Zero();  // headset frame, before stabilisation; valid when seen
    // Inverse covariance of position_mm, 1/mm^2. Rank 3 from two cameras or a 3D stream; rank 2 from one
    // camera, when the depth of position_mm along the ray is only predicted.
    Mat3 information = Mat3::Zero();
};

struct NamedMarkers {
    std::int64_t capture_us = 0;
    std::uint16_t count = 0;  // of the layout; entries [0, count)
    std::array<NamedMarker, kMaxMarkers> markers{};
};

}  // namespace rig
