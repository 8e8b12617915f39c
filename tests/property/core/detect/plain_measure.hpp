// The measurement of a marker's centre as one would write it first: doubles, vectors, a distance test per
// pixel and no care for time. The detector's bit rows, integer sums and two-step fits must agree with it.
// Dark markers only.
#pragma once

#include "tests/support/dot_scene/dot_scene.hpp"

namespace rig::test {

struct PlainCentre {
    double x_px = 0.0;
    double y_px = 0.0;
    bool ok = false;
};

// Around a first guess, for a marker whose longest diameter is `diameter_px`.
[[nodiscard]] PlainCentre plain_centre(const Picture& picture, double x_px, double y_px, double diameter_px);

}  // namespace rig::test
