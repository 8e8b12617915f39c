#include "core/infer/face_gaussian.hpp"

#include <cmath>

#include "core/base/check.hpp"
#include "core/base/dense.hpp"

namespace rig {

namespace {

// The whole-face set holds every marker in order.
void take_marker_set(const SolvePack& pack, FaceGaussian& face) {
    const MarkerSetModel& set = pack.marker_sets[0];
    RIG_CHECK(set.marker_count == pack.marker_count && set.mode_count <= kMaxModes);
    face.mode_count = set.mode_count;
    const std::size_t rows = 3U * set.marker_count;
    for (std::size_t r = 0; r < rows; ++r) {
        face.mean_mm[r / 3][static_cast<Eigen::Index>(r % 3)] =
            static_cast<double>(pack.neutral_mm[r]) + static_cast<double>(set.mean_mm[r]);
        for (std::size_t j = 0; j < set.mode_count; ++j) {
            face.modes[r * kMaxModes + j] = static_cast<double>(set.modes[j * rows + r]) *
                                            std::sqrt(static_cast<double>(set.variance_mm2[j]));
        }
    }
    for (std::size_t k = 0; k < set.marker_count; ++k)
        face.residual_mm2[k] = static_cast<double>(set.residual_mm2[k]);
}

void take_shape_model(const ShapeModel& model, FaceGaussian& face) {
    face.mode_count = model.mode_count;
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        face.mean_mm[k] = model.mean_mm[k];
        face.residual_mm2[k] = model.residual_mm * model.residual_mm;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            for (std::size_t j = 0; j < model.mode_count; ++j) {
                face.modes[(3 * k + axis) * kMaxModes + j] =
                    model.modes[k * model.mode_count + j][static_cast<Eigen::Index>(axis)];
            }
        }
    }
}

// (M M^T + D)^-1 = D^-1 - V V^T with V = D^-1 M L^-T and L L^T = I + M^T D^-1 M.
void build_precision(FaceGaussianWorkspace& w, FaceGaussian& face) {
    const std::size_t rows = 3U * face.marker_count;
    const std::size_t d = face.mode_count;
    w.factor.fill(0.0);
    for (std::size_t i = 0; i < d; ++i) w.factor[i * kMaxModes + i] = 1.0;
    for (std::size_t r = 0; r < rows; ++r) {
        const double weight = face.measured_weight(r / 3);
        const double* row = face.mode_row(r);
        for (std::size_t i = 0; i < d; ++i)
            add_scaled(w.factor.data() + i * kMaxModes, weight * row[i], row, i + 1);
    }
    for (std::size_t i = 0; i < d; ++i) {
        for (std::size_t j = 0; j <= i; ++j) {
            const double entry = w.factor[i * kMaxModes + j];
            face.measured_modes[i * kMaxModes + j] = entry;
            face.measured_modes[j * kMaxModes + i] = entry;
        }
    }
    const bool positive = cholesky(w.factor.data(), w.factor.data(), d, kMaxModes, 0.0);
    RIG_CHECK(positive);  // I plus squares
    for (std::size_t r = 0; r < rows; ++r) {
        const double weight = face.measured_weight(r / 3);
        double* v = w.whitened.data() + r * kMaxModes;
        for (std::size_t j = 0; j < d; ++j) v[j] = weight * face.mode_row(r)[j];
        solve_lower(w.factor.data(), d, kMaxModes, v);
        for (std::size_t s = 0; s <= r; ++s) {
            const double shared = -dot(v, w.whitened.data() + s * kMaxModes, d);
            face.precision[r * kMaxRows + s] = shared;
            face.precision[s * kMaxRows + r] = shared;
        }
        face.precision[r * kMaxRows + r] += weight;
    }
}

}  // namespace

void build_face_gaussian(const SolvePack& pack, const ShapeModel& model, FaceGaussianWorkspace& workspace,
                         FaceGaussian& face) {
    RIG_CHECK(pack.marker_count <= kMaxMarkers);
    const auto noise_mm = static_cast<double>(pack.noise_mm);
    face.modes.fill(0.0);  // kernels read rows to their end
    face.precision.fill(0.0);
    face.measured_modes.fill(0.0);
    face.marker_count = pack.marker_count;
    face.noise_mm2 = noise_mm * noise_mm;
    if (pack.marker_set_count > 0) {
        take_marker_set(pack, face);
    } else {
        RIG_CHECK(model.marker_count == pack.marker_count);
        take_shape_model(model, face);
    }
    for (std::size_t k = 0; k < face.marker_count; ++k) {
        face.prior_mm2[k] = 3.0 * face.residual_mm2[k];
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double* row = face.mode_row(3 * k + axis);
            face.prior_mm2[k] += dot(row, row, face.mode_count);
        }
    }
    build_precision(workspace, face);
}

}  // namespace rig
