// Where the markers are that were not seen: the conditional mean of the face's Gaussian given those that were. This is
// the closed form of methods.md section 2 (least squares of the seen rows in the subspace with a Tikhonov prior from
// the variances), for one set that holds the whole face.
#pragma once

#include <array>
#include <cstdint>

#include "core/geometry/shape_model.hpp"
#include "core/stabilise/stabiliser.hpp"

namespace rig {

struct InferenceOutput {
    std::uint16_t count = 0;
    std::uint16_t inferred = 0;
    std::array<Vec3, kMaxMarkers> position_mm{};  // face frame: measured where seen, inferred elsewhere
};

// A marker seen by one camera keeps its measured direction and takes the inferred depth.
void infer_missing(const ShapeModel& model, const StabiliserOutput& stabilised, InferenceOutput& output);

}  // namespace rig
