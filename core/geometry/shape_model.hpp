// A face as a Gaussian: mean positions of the markers plus independent unit-variance modes, worn at a rigid
// pose. Fitting it (shape_fit.hpp) answers three questions at once: how the helmet sits, what the face does,
// where an unseen marker is. Tracker, stabiliser and inference share it. Not for: weights; their bounds are
// the solver's business.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/float_kernels.hpp"
#include "core/base/linalg.hpp"
#include "core/limits.hpp"

namespace rig {

// Marker k: mean_mm[k] + sum_j c_j modes[k * mode_count + j], c ~ N(0, I). Face frame, mm. The modes are the
// leading eigenvectors of B S B^T (methods.md section 1), S = diag(sigma^2) of the pack; what is cut off is
// residual_mm.
struct ShapeModel {
    static constexpr std::size_t kColumnStride = row_stride(kMaxRows);
    std::uint16_t marker_count = 0;
    std::uint16_t mode_count = 0;
    double residual_mm = 0.0;  // rms of a coordinate's motion that the kept modes do not explain
    std::array<Vec3, kMaxMarkers> mean_mm{};
    std::array<Vec3, kMaxMarkers * kMaxModes> modes{};
    // The modes again, rounded, for the kernels of the fit: coordinate 3 k + axis of mode j, zeros elsewhere.
    std::array<float, kMaxRows * kMaxModes> rows{};          // [3 k + axis][j]
    std::array<float, kMaxModes * kColumnStride> columns{};  // [j][3 k + axis]

    [[nodiscard]] Vec3 face_position(std::size_t marker, std::span<const double> coefficients) const;
};

// Fills rows and columns from modes: whoever writes modes calls it.
void round_modes(ShapeModel& model);

// Scratch of the function below; large, so it lives with its owner.
struct ShapeModelWorkspace {
    std::array<double, kMaxShapes * kMaxShapes> gram{};
    std::array<double, kMaxShapes * kMaxShapes> vectors{};
    std::array<double, kMaxShapes> values{};
};

// neutral [3m], basis [3m x N] row-major, prior mean and sigma [N], as in SolvePack.
void build_shape_model(std::span<const float> neutral_mm, std::span<const float> basis_mm,
                       std::span<const float> prior_mean, std::span<const float> prior_sigma,
                       ShapeModelWorkspace& workspace, ShapeModel& model);

}  // namespace rig
