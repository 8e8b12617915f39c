// Calibrated cameras put to the test that counts: the board's points triangulated by core, as the device will
// do with markers, against the flat board they lie on.
#pragma once

#include "firmware_host/companion/calibrate/bundle.hpp"
#include "firmware_host/companion/calibrate/calibration.hpp"

namespace rig::host {

// Of every view, after the rigid motion that fits it best. Zero points when no view has three points that two
// cameras saw.
[[nodiscard]] TriangulationCheck check_triangulation(const BundleProblem& problem);

}  // namespace rig::host
