// Fits the Gaussian face to named markers: pose and expression at once, by Newton's method with a matrix that
// is kept. The step needs J^T W J only well enough to head downhill, the gradient is exact, so the matrix of
// the frame before serves as long as few markers changed (shape_information.hpp).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/geometry/shape_information.hpp"
#include "core/geometry/shape_model.hpp"

namespace rig {

// What is believed before a frame is looked at.
struct ShapePrior {
    Rigid pose;  // headset_from_face
    double rotation_sigma_rad = 0.1;
    double translation_sigma_mm = 10.0;
    std::array<double, kMaxModes> coefficients{};
    double coefficient_sigma = 1.0;  // about `coefficients`, in the modes' own standard deviations
};

struct ShapeFit {
    Rigid pose;  // headset_from_face
    std::array<double, kMaxModes> coefficients{};
    bool ok = false;         // false: the normal equations were not positive definite; the prior is returned
    double objective = 0.0;  // sum of whitened squared residuals plus priors, at the answer

    [[nodiscard]] Vec3 headset_position(const ShapeModel& model, std::size_t marker) const {
        return pose.apply(model.face_position(marker, coefficients));
    }
};

// Survives between fits of one stream of frames. The answer depends on it by less than the step tolerance.
struct ShapeFitMemory {
    ShapeInformation information;
    ShapeFactor factor;
};

void forget(ShapeFitMemory& memory);

struct ShapeFitWorkspace {
    static constexpr std::size_t kSize = ShapeInformation::kSize;
    ShapeFitMemory memory;                       // of fits without one of their own
    std::array<Vec3, kMaxMarkers> face_mm{};     // the fitted face: [marker_count], seen or not
    std::array<Vec3, kMaxMarkers> headset_mm{};  // ... as it sits under the helmet
    std::array<double, kSize + kLaneFloats> right{};
    std::array<float, kMaxModes> coefficients{};
    std::array<float, padded(kMaxRows)> moved_mm{};  // what the modes add to the mean
    std::array<float, kMaxRows> pull{};              // information times residual, face frame
    std::array<float, padded(kMaxModes)> slope{};
};

struct ShapeFitLimits {
    int steps = 6;
    // The last step taken is shorter than this, in standard deviations of what is fitted (Newton decrement),
    // or the next would be shorter than half of it, as the last three shrink.
    double step_sigmas = 1e-2;
};

// Minimises over pose and c:  sum_k (x_k - R q_k(c) - t)^T A_k (x_k - R q_k(c) - t) + |c - c0|^2 / sigma_c^2
// + |dr|^2 / sigma_r^2 + |dt|^2 / sigma_t^2, from `start`.
// With A = I / s^2 and c eliminated this is the covariance-weighted rigid fit with C = B S B^T + s^2 I.
// positions and informations: [marker_count]; A_k = 0 means that marker k was not seen. workspace.headset_mm
// and face_mm then hold the fitted markers.
void fit_shape(const ShapeModel& model, std::span<const Vec3> positions_mm,
               std::span<const Mat3> informations, const ShapePrior& prior, const ShapeFitLimits& limits,
               const ShapeFit& start, ShapeFitMemory& memory, ShapeFitWorkspace& workspace, ShapeFit& fit);

// The same without a memory: at most `steps` steps, as far as they lead.
void fit_shape(const ShapeModel& model, std::span<const Vec3> positions_mm,
               std::span<const Mat3> informations, const ShapePrior& prior, int steps, const ShapeFit& start,
               ShapeFitWorkspace& workspace, ShapeFit& fit);

// How well the fit knows a fitted marker, seen or not: its covariance in the face frame, mm^2, after
// fit_shape() with this memory and workspace. To a tenth: from the matrix that is kept.
[[nodiscard]] Mat3 fitted_covariance(const ShapeModel& model, std::size_t marker,
                                     const ShapeFitMemory& memory, ShapeFitWorkspace& workspace);

}  // namespace rig
