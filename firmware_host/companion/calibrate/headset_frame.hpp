// From the frame of the first camera to the headset's. Calibration knows how cameras stand to each other; how
// they stand to the face is the helmet's construction or, failing that, a guess that tracking can start from.
#pragma once

#include <span>
#include <vector>

#include "core/geometry/camera_model.hpp"

namespace rig::host {

// Moves the rig as a whole so that its cameras stand as near as possible to where `reference` has them, by
// least squares over centres and axes (the ends of axes of 100 mm). Returns the rms distance of the centres
// afterwards, mm. Precondition: as many reference cameras, in the same order.
double align_to_reference(std::vector<CameraModel>& cameras, std::span<const CameraModel> reference);

// For a rig without reference: the cameras look at the point between nose and lips from the front and stand
// upright. y of the mean camera points down, the optical axes meet (or, for one camera or parallel axes, end
// distance_mm away) at that point. Good to some 10 degrees and 15 mm, which is what tracking starts from.
void place_before_face(std::vector<CameraModel>& cameras, double distance_mm);

}  // namespace rig::host
