// How all markers of a face move together, as inference needs it: a Gaussian over every coordinate, with its
// precision matrix worked out once, so that a frame with a few unseen markers costs one small Cholesky
// factor.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/float_kernels.hpp"
#include "core/base/linalg.hpp"
#include "core/geometry/shape_model.hpp"
#include "core/limits.hpp"
#include "core/pack/solve_pack.hpp"

namespace rig {

// Rows of both matrices are zero behind their last column: kernels read them to a multiple of kLaneFloats.
static_assert(kMaxModes % kLaneFloats == 0 && kMaxRows % kLaneFloats == 0);

// Marker k: mean_mm[k] + modes c + e, c ~ N(0, I), e ~ N(0, residual_mm2[k] I); measured with noise_mm2 I.
// Face frame, mm.
struct FaceGaussian {
    std::uint16_t marker_count = 0;
    std::uint16_t mode_count = 0;
    double noise_mm2 = 0.0;  // of one measured coordinate
    std::array<Vec3, kMaxMarkers> mean_mm{};
    std::array<double, kMaxRows * kMaxModes> modes{};  // rows x0, y0, z0, x1, ..., kMaxModes apart
    std::array<double, kMaxMarkers> residual_mm2{};    // of one coordinate: what the modes leave
    std::array<double, kMaxMarkers> prior_mm2{};       // trace of the marker's covariance
    // Of the modes when every marker is measured: I + sum_k M_k^T M_k measured_weight(k); symmetric, rows
    // kMaxModes apart, zeros behind the modes.
    std::array<double, kMaxModes * kMaxModes> measured_modes{};
    // Of the measured coordinates; rows kMaxRows apart, zeros behind 3m.
    std::array<double, kMaxRows * kMaxRows> precision{};

    // Of one coordinate of a measured marker about what the modes say, 1/mm^2.
    [[nodiscard]] double measured_weight(std::size_t marker) const {
        return 1.0 / (noise_mm2 + residual_mm2[marker]);
    }
    [[nodiscard]] const double* mode_row(std::size_t row) const { return modes.data() + row * kMaxModes; }
};

struct FaceGaussianWorkspace {
    std::array<double, kMaxModes * kMaxModes> factor{};
    std::array<double, kMaxRows * kMaxModes> whitened{};
};

// From the pack's whole-face marker set; from the rig's own shapes (`model`) when the pack has none. The
// pack's numbers are checked. For set-up: about rows^2 modes / 2 + rows modes^2 multiply-adds.
void build_face_gaussian(const SolvePack& pack, const ShapeModel& model, FaceGaussianWorkspace& workspace,
                         FaceGaussian& face);

}  // namespace rig
