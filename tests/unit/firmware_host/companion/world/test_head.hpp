// Heads so simple that a test can say by formula what a camera sees.
#pragma once

#include <memory>

#include "firmware_host/companion/world/world.hpp"

namespace rig::test {

// A flat sheet of skin, 120 x 120 mm, at z = 20, facing +z; nine markers 30 mm apart, the middle one at the
// origin of x and y. Shapes: "lift" moves it all 10 mm in +y, "stretch" widens it by 10 % in x. With `plate`,
// another sheet of another part hangs 40 mm in front of the markers with x < 0.
struct TestHead {
    host::Rig rig;
    host::MarkerLayout layout;
    host::Take take;  // 40 frames; lift rises from 0 to 0.39, stretch swings
};
[[nodiscard]] TestHead flat_head(bool plate = false);

// One straight-on camera, 230 mm in front of the sheet, 256 x 256 px, 2.6 px a millimetre; k1, k2 as given.
[[nodiscard]] host::HelmetCamera straight_camera(double k1 = 0.0, double k2 = 0.0);

// Dies with the fault when the world cannot be made.
[[nodiscard]] std::unique_ptr<host::World> make_world(const TestHead& head, const host::WorldConfig& config);

// No blur, no noise, no vignetting, no slip.
[[nodiscard]] host::WorldConfig clean_config(const host::HelmetCamera& camera);

}  // namespace rig::test
