// A face as a Gaussian: mean positions of the markers plus independent unit-variance modes, worn at a rigid
// pose. Fitting it answers three questions at once: how the helmet sits, what the face does, where an unseen
// marker is. Tracker, stabiliser and inference share it. Not for: weights; their bounds are the solver's
// business.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/linalg.hpp"
#include "core/limits.hpp"

namespace rig {

// Marker k: mean_mm[k] + sum_j c_j modes[k * mode_count + j], c ~ N(0, I). Face frame, mm. The modes are the
// leading eigenvectors of B S B^T (methods.md section 1), S = diag(sigma^2) of the pack; what is cut off is
// residual_mm.
struct ShapeModel {
    std::uint16_t marker_count = 0;
    std::uint16_t mode_count = 0;
    double residual_mm = 0.0;  // rms of a coordinate's motion that the kept modes do not explain
    std::array<Vec3, kMaxMarkers> mean_mm{};
    std::array<Vec3, kMaxMarkers * kMaxModes> modes{};

    [[nodiscard]] Vec3 face_position(std::size_t marker, std::span<const double> coefficients) const;
};

// Scratch of the two functions below; large, so it lives with its owner.
struct ShapeModelWorkspace {
    std::array<double, kMaxShapes * kMaxShapes> gram{};
    std::array<double, kMaxShapes * kMaxShapes> vectors{};
    std::array<double, kMaxShapes> values{};
};

// neutral [3m], basis [3m x N] row-major, prior mean and sigma [N], as in SolvePack.
void build_shape_model(std::span<const float> neutral_mm, std::span<const float> basis_mm,
                       std::span<const float> prior_mean, std::span<const float> prior_sigma,
                       ShapeModelWorkspace& workspace, ShapeModel& model);

// What is believed before a frame is looked at.
struct ShapePrior {
    Rigid pose;  // headset_from_face
    double rotation_sigma_rad = 0.1;
    double translation_sigma_mm = 10.0;
    std::array<double, kMaxModes> coefficients{};
    double coefficient_sigma = 1.0;  // about `coefficients`, in the modes' own standard deviations
};

struct ShapeFitWorkspace {
    static constexpr std::size_t kSize = 6 + kMaxModes;
    std::array<double, kSize * kSize> normal{};
    std::array<double, kSize> right{};
    std::array<double, 3 * kSize> rows{};
    std::array<double, 3 * kSize> weighted{};
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

// Minimises over pose and c:  sum_k (x_k - R q_k(c) - t)^T A_k (x_k - R q_k(c) - t) + |c - c0|^2 / sigma_c^2
// + |dr|^2 / sigma_r^2 + |dt|^2 / sigma_t^2, by `iterations` Gauss-Newton steps from `start`.
// With A = I / s^2 and c eliminated this is the covariance-weighted rigid fit with C = B S B^T + s^2 I.
// positions and informations: [marker_count]; A_k = 0 means that marker k was not seen.
void fit_shape(const ShapeModel& model, std::span<const Vec3> positions_mm,
               std::span<const Mat3> informations, const ShapePrior& prior, int iterations,
               const ShapeFit& start, ShapeFitWorkspace& workspace, ShapeFit& fit);

}  // namespace rig
