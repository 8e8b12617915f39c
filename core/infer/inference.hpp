// Where the markers are that were not seen: the conditional mean of the face's Gaussian given those that
// were. This is the closed form of methods.md section 2 (least squares of the seen rows in the subspace with
// a Tikhonov prior from the variances), for one set that holds the whole face.
#pragma once

#include "core/geometry/shape_model.hpp"
#include "core/infer/completed_markers.hpp"
#include "core/stabilise/stabilised_markers.hpp"

namespace rig {

// A marker seen by one camera keeps its measured direction and takes the inferred depth.
void infer_missing(const ShapeModel& model, const StabiliserOutput& stabilised, InferenceOutput& output);

}  // namespace rig
