// Where the markers are that were not seen, and how far to trust it: the conditional mean and covariance of
// the face's Gaussian given the markers that were. This is the closed form of methods.md section 2: least
// squares of the seen rows in the subspace with a Tikhonov prior from the variances.
#pragma once

#include <array>
#include <cstdint>

#include "core/infer/completed_markers.hpp"
#include "core/infer/face_gaussian.hpp"
#include "core/infer/mode_posterior.hpp"
#include "core/stabilise/stabilised_markers.hpp"

namespace rig {

// Scratch, and what was worked out for the markers that were hidden in the frame before: as long as the same
// ones are, a frame costs two products with it. The answer does not depend on that.
struct InferenceWorkspace {
    static constexpr std::size_t kMaxHiddenRows = 96;  // solved through the precision matrix
    static constexpr std::size_t kStride = kMaxHiddenRows + kLaneFloats;
    enum class Prepared : std::uint8_t { kNothing = 0, kPrecision = 1, kModes = 2 };

    Prepared prepared = Prepared::kNothing;
    std::array<MarkerKnowledge, kMaxMarkers> prepared_for{};
    std::array<double, kMaxHiddenRows * kStride> inverse{};  // L^-1 of the hidden rows
    ModePosterior modes;
    std::array<double, kMaxMarkers> variance_mm2{};  // trace of each unmeasured marker's posterior

    std::array<double, kMaxHiddenRows * kStride> system{};
    std::array<double, kMaxRows> error_mm{};  // measured minus mean; 0 where nothing was measured
    std::array<double, kMaxRows> right{};
    std::array<double, kMaxRows> half{};
    std::array<std::uint16_t, kMaxMarkers> hidden{};
    std::array<std::uint16_t, kMaxMarkers> unmeasured{};  // hidden or partly measured
};

// To be called when `face` has been built anew.
void reset_inference(InferenceWorkspace& workspace);

// A measured marker passes unchanged. A marker seen by one camera keeps its measured direction and takes the
// inferred depth. An inferred marker is never farther from the mean face than six times its usual spread,
// whatever was measured elsewhere; with nothing seen it is the mean face. Work is bounded: one Cholesky
// factor of three rows a hidden marker (at most kMaxHiddenRows), or one of the modes.
void infer_missing(const FaceGaussian& face, const StabiliserOutput& stabilised,
                   InferenceWorkspace& workspace, InferenceOutput& output);

}  // namespace rig
