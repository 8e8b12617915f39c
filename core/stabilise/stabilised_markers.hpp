// What stabilisation hands on: the markers in the face frame, and the pose they were seen in.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/linalg.hpp"
#include "core/geometry/shape_fit.hpp"
#include "core/limits.hpp"

namespace rig {

struct StabilisedMarker {
    bool seen = false;
    Vec3 position_mm = Vec3::Zero();  // face frame
    Mat3 information = Mat3::Zero();  // 1/mm^2, face frame; zero when not seen
};

struct StabiliserOutput {
    std::uint16_t count = 0;
    std::array<StabilisedMarker, kMaxMarkers> markers{};
    Rigid headset_from_face;  // the slip: observed = R face + t
    ShapeFit fit;             // pose and expression in the Gaussian's terms, for inference
};

}  // namespace rig
