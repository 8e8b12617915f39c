// Everything precomputed for one performer and one rig, as core reads it: spans into the verified bytes of a
// pack.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "core/geometry/camera_model.hpp"
#include "core/limits.hpp"

namespace rig {

enum class SolverKind : std::uint8_t { kLeastSquares = 0, kNonNegative = 1, kBoxQp = 2, kRbf = 3 };

// Gaussian RBF regression [Deng06 eq. 3-6]: x = basis (t - mean); h_k = exp(-|x - c_k|^2 / (2 width_k^2));
// w = weights^T h + offset.
struct RbfModel {
    std::uint16_t dimension_count = 0;  // d
    std::uint16_t centre_count = 0;     // K
    std::span<const float> mean_mm;     // [3m]
    std::span<const float> basis;       // [d x 3m] row-major, orthonormal rows
    std::span<const float> centres;     // [K x d] row-major, mm
    std::span<const float> widths_mm;   // [K], > 0
    std::span<const float> weights;     // [K x N] row-major
    std::span<const float> offset;      // [N]
};

// Column i of the basis is (shape i - neutral) at the markers; rows x0, y0, z0, x1, ... of marker k at 3k.
// Frames: face frame of the rig, mm: +x performer's left, +y up, +z out of the face, origin between the
// eyeballs.
struct SolvePack {
    std::uint16_t marker_count = 0;  // m, kMinMarkers..kMaxMarkers
    std::uint16_t shape_count = 0;   // N, 1..kMaxShapes
    SolverKind solver = SolverKind::kBoxQp;
    float rate_hz = 60.0F;  // the rate its temporal numbers were trained for

    std::span<const float> neutral_mm;   // b0 [3m]
    std::span<const float> basis_mm;     // B [3m x N] row-major
    std::span<const float> weight_low;   // [N]
    std::span<const float> weight_high;  // [N], >= low
    std::span<const float> prior_mean;   // [N] expected weights
    std::span<const float> prior_sigma;  // [N] > 0, expected spread of each weight: S = diag(sigma^2)
    std::span<const float>
        temporal_gamma;         // [N] >= 0, mm^2: pull towards the previous solution, in units of E
    float noise_mm = 0.1F;      // s: standard deviation of one marker coordinate
    float sparsity_mm2 = 0.0F;  // beta: E += beta |w|_1             [Hybrid16 eq. 3]
    float ridge_mm2 = 0.0F;     // eps:  E += eps |w|^2              [Hybrid16 eq. 3]
    RbfModel rbf;               // empty unless solver == kRbf

    std::uint8_t camera_count = 0;  // 0 for packs that only solve marker streams
    std::array<CameraModel, kMaxCameras> cameras{};

    std::array<std::string_view, kMaxShapes> shape_names{};
    std::array<std::string_view, kMaxMarkers> marker_names{};
};

}  // namespace rig
