// Where the markers are that were not seen, and how far to trust it: the conditional mean and covariance of
// the face's Gaussian given the markers that were. This is the closed form of methods.md section 2: least
// squares of the seen rows in the subspace with a Tikhonov prior from the variances.
#pragma once

#include <array>
#include <cstdint>

#include "core/infer/completed_markers.hpp"
#include "core/infer/face_gaussian.hpp"
#include "core/stabilise/stabilised_markers.hpp"

namespace rig {

struct InferenceWorkspace {
    static constexpr std::size_t kMaxHiddenRows = 96;  // solved through the precision matrix
    std::array<double, kMaxHiddenRows * kMaxHiddenRows> factor{};
    std::array<double, kMaxRows> error_mm{};  // measured minus mean; 0 where nothing was measured
    std::array<double, kMaxRows> right{};
    std::array<double, kMaxRows> variance_mm2{};
    std::array<double, 3 * kMaxModes> weighted{};
    std::array<std::uint16_t, kMaxMarkers> hidden{};
    std::array<std::uint8_t, kMaxMarkers> knowledge{};
};

// A measured marker passes unchanged. A marker seen by one camera keeps its measured direction and takes the
// inferred depth. An inferred marker is never farther from the mean face than six times its usual spread,
// whatever was measured elsewhere; with nothing seen it is the mean face. Work is bounded: one Cholesky
// factor of three rows a hidden marker (at most kMaxHiddenRows), or one of the modes.
void infer_missing(const FaceGaussian& face, const StabiliserOutput& stabilised,
                   InferenceWorkspace& workspace, InferenceOutput& output);

}  // namespace rig
