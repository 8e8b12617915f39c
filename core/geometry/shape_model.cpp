#include "core/geometry/shape_model.hpp"

#include <cmath>

#include "core/base/check.hpp"
#include "core/base/dense.hpp"
#include "core/base/math.hpp"

namespace rig {

namespace {

constexpr double kSmallestModeMm =
    0.01;  // rms over all coordinates; below it a mode is under any camera's noise

// Gram matrix S^1/2 B^T B S^1/2 in workspace.gram.
void build_gram(std::span<const float> basis_mm, std::span<const float> sigma,
                ShapeModelWorkspace& workspace) {
    const std::size_t n = sigma.size();
    const std::size_t rows = basis_mm.size() / n;
    workspace.gram.fill(0.0);
    for (std::size_t r = 0; r < rows; ++r) {
        const float* row = basis_mm.data() + r * n;
        for (std::size_t i = 0; i < n; ++i) {
            const double left = static_cast<double>(row[i]) * static_cast<double>(sigma[i]);
            if (left == 0.0) continue;
            for (std::size_t j = 0; j < n; ++j) {
                workspace.gram[i * kMaxShapes + j] +=
                    left * static_cast<double>(row[j]) * static_cast<double>(sigma[j]);
            }
        }
    }
}

double leading_modes(const ShapeModelWorkspace& workspace, std::size_t n, std::size_t rows,
                     std::uint16_t& kept) {
    kept = 0;
    double left_out = 0.0;
    const double smallest = kSmallestModeMm * kSmallestModeMm * static_cast<double>(rows);
    for (std::size_t i = 0; i < n; ++i) {
        if (kept < kMaxModes && workspace.values[i] > smallest) {
            ++kept;
        } else if (workspace.values[i] > 0.0) {
            left_out += workspace.values[i];
        }
    }
    return std::sqrt(left_out / static_cast<double>(rows));
}

// Rows [ -[R q]x | I | R M ] of the residual's derivative, three of them, `stride` apart.
void fill_rows(const ShapeModel& model, std::size_t marker, const Rigid& pose, const Vec3& turned,
               double* rows, std::size_t stride) {
    const double x = turned[0];
    const double y = turned[1];
    const double z = turned[2];
    const double head[3][6] = {
        {0.0, z, -y, 1.0, 0.0, 0.0}, {-z, 0.0, x, 0.0, 1.0, 0.0}, {y, -x, 0.0, 0.0, 0.0, 1.0}};
    for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 6; ++c) rows[r * stride + c] = head[r][c];
    }
    const Vec3* modes = model.modes.data() + marker * model.mode_count;
    for (std::size_t j = 0; j < model.mode_count; ++j) {
        const Vec3 moved = pose.rotation * modes[j];
        for (std::size_t r = 0; r < 3; ++r) rows[r * stride + 6 + j] = moved[static_cast<Eigen::Index>(r)];
    }
}

// Adds J^T A J to the lower triangle and J^T A e to the right side.
void add_marker(const Mat3& information, const Vec3& error, std::size_t size, ShapeFitWorkspace& w) {
    constexpr std::size_t kStride = ShapeFitWorkspace::kSize;
    for (std::size_t r = 0; r < 3; ++r) {
        const auto row = static_cast<Eigen::Index>(r);
        for (std::size_t c = 0; c < size; ++c) {
            w.weighted[r * kStride + c] = information(row, 0) * w.rows[c] +
                                          information(row, 1) * w.rows[kStride + c] +
                                          information(row, 2) * w.rows[2 * kStride + c];
        }
    }
    for (std::size_t i = 0; i < size; ++i) {
        const double a0 = w.rows[i];
        const double a1 = w.rows[kStride + i];
        const double a2 = w.rows[2 * kStride + i];
        double* out = w.normal.data() + i * kStride;
        for (std::size_t j = 0; j <= i; ++j) {
            out[j] += a0 * w.weighted[j] + a1 * w.weighted[kStride + j] + a2 * w.weighted[2 * kStride + j];
        }
        w.right[i] += w.weighted[i] * error[0] + w.weighted[kStride + i] * error[1] +
                      w.weighted[2 * kStride + i] * error[2];
    }
}

struct PriorOffsets {
    Vec3 rotation_rad;
    Vec3 translation_mm;
};

PriorOffsets offsets_from_prior(const ShapeFit& fit, const ShapePrior& prior) {
    const Mat3 turned = fit.pose.rotation * prior.pose.rotation.transpose();
    return {vector_from_rotation(turned), fit.pose.translation_mm - prior.pose.translation_mm};
}

void add_prior(const ShapeFit& fit, const ShapePrior& prior, std::size_t modes, ShapeFitWorkspace& w) {
    constexpr std::size_t kStride = ShapeFitWorkspace::kSize;
    const double by_rotation = 1.0 / (prior.rotation_sigma_rad * prior.rotation_sigma_rad);
    const double by_translation = 1.0 / (prior.translation_sigma_mm * prior.translation_sigma_mm);
    const double by_mode = 1.0 / (prior.coefficient_sigma * prior.coefficient_sigma);
    const PriorOffsets offsets = offsets_from_prior(fit, prior);
    for (std::size_t i = 0; i < 3; ++i) {
        const auto axis = static_cast<Eigen::Index>(i);
        w.normal[i * kStride + i] += by_rotation;
        w.right[i] -= by_rotation * offsets.rotation_rad[axis];
        w.normal[(3 + i) * kStride + 3 + i] += by_translation;
        w.right[3 + i] -= by_translation * offsets.translation_mm[axis];
    }
    for (std::size_t j = 0; j < modes; ++j) {
        w.normal[(6 + j) * kStride + 6 + j] += by_mode;
        w.right[6 + j] -= by_mode * (fit.coefficients[j] - prior.coefficients[j]);
    }
}

double objective(const ShapeModel& model, std::span<const Vec3> positions, std::span<const Mat3> informations,
                 const ShapePrior& prior, const ShapeFit& fit) {
    double sum = 0.0;
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        if (informations[k](0, 0) == 0.0 && informations[k](1, 1) == 0.0) continue;
        const Vec3 e = positions[k] - fit.headset_position(model, k);
        const Vec3 weighted = informations[k] * e;
        sum += e.dot(weighted);
    }
    const PriorOffsets offsets = offsets_from_prior(fit, prior);
    sum += offsets.rotation_rad.dot(offsets.rotation_rad) /
           (prior.rotation_sigma_rad * prior.rotation_sigma_rad);
    sum += offsets.translation_mm.dot(offsets.translation_mm) /
           (prior.translation_sigma_mm * prior.translation_sigma_mm);
    for (std::size_t j = 0; j < model.mode_count; ++j) {
        const double d = (fit.coefficients[j] - prior.coefficients[j]) / prior.coefficient_sigma;
        sum += d * d;
    }
    return sum;
}

bool gauss_newton_step(const ShapeModel& model, std::span<const Vec3> positions,
                       std::span<const Mat3> informations, const ShapePrior& prior, ShapeFitWorkspace& w,
                       ShapeFit& fit) {
    constexpr std::size_t kStride = ShapeFitWorkspace::kSize;
    const std::size_t size = 6U + model.mode_count;
    w.normal.fill(0.0);
    w.right.fill(0.0);
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        const Mat3& a = informations[k];
        if (a(0, 0) == 0.0 && a(1, 1) == 0.0) continue;
        const Vec3 turned = fit.pose.rotation * model.face_position(k, fit.coefficients);
        fill_rows(model, k, fit.pose, turned, w.rows.data(), kStride);
        add_marker(a, positions[k] - (turned + fit.pose.translation_mm), size, w);
    }
    add_prior(fit, prior, model.mode_count, w);
    if (!cholesky(w.normal.data(), w.normal.data(), size, kStride)) return false;
    solve_lower(w.normal.data(), size, kStride, w.right.data());
    solve_lower_transposed(w.normal.data(), size, kStride, w.right.data());
    const Mat3 turn = rotation_from_vector(Vec3{w.right[0], w.right[1], w.right[2]});
    const Mat3 turned = turn * fit.pose.rotation;
    fit.pose.rotation = orthonormalised(turned);
    fit.pose.translation_mm += Vec3{w.right[3], w.right[4], w.right[5]};
    for (std::size_t j = 0; j < model.mode_count; ++j) fit.coefficients[j] += w.right[6 + j];
    return true;
}

}  // namespace

Vec3 ShapeModel::face_position(std::size_t marker, std::span<const double> coefficients) const {
    Vec3 position = mean_mm[marker];
    const Vec3* row = modes.data() + marker * mode_count;
    for (std::size_t j = 0; j < mode_count; ++j) position += coefficients[j] * row[j];
    return position;
}

void build_shape_model(std::span<const float> neutral_mm, std::span<const float> basis_mm,
                       std::span<const float> prior_mean, std::span<const float> prior_sigma,
                       ShapeModelWorkspace& workspace, ShapeModel& model) {
    const std::size_t n = prior_mean.size();
    const std::size_t rows = neutral_mm.size();
    RIG_CHECK(rows % 3 == 0 && rows <= kMaxRows && n <= kMaxShapes && basis_mm.size() == rows * n);
    RIG_CHECK(prior_sigma.size() == n);
    build_gram(basis_mm, prior_sigma, workspace);
    symmetric_eigen(workspace.gram.data(), n, kMaxShapes, workspace.values.data(), workspace.vectors.data());
    model.marker_count = static_cast<std::uint16_t>(rows / 3);
    model.residual_mm = leading_modes(workspace, n, rows, model.mode_count);
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto at = static_cast<Eigen::Index>(axis);
            const float* row = basis_mm.data() + (3 * k + axis) * n;
            double mean = static_cast<double>(neutral_mm[3 * k + axis]);
            for (std::size_t i = 0; i < n; ++i)
                mean += static_cast<double>(row[i]) * static_cast<double>(prior_mean[i]);
            model.mean_mm[k][at] = mean;
            for (std::size_t j = 0; j < model.mode_count; ++j) {
                double sum = 0.0;
                for (std::size_t i = 0; i < n; ++i) {
                    sum += static_cast<double>(row[i]) * static_cast<double>(prior_sigma[i]) *
                           workspace.vectors[i * kMaxShapes + j];
                }
                model.modes[k * model.mode_count + j][at] = sum;
            }
        }
    }
}

void fit_shape(const ShapeModel& model, std::span<const Vec3> positions_mm,
               std::span<const Mat3> informations, const ShapePrior& prior, int iterations,
               const ShapeFit& start, ShapeFitWorkspace& workspace, ShapeFit& fit) {
    RIG_CHECK(positions_mm.size() == model.marker_count && informations.size() == model.marker_count);
    fit = start;
    fit.ok = true;
    for (int i = 0; i < iterations && fit.ok; ++i) {
        fit.ok = gauss_newton_step(model, positions_mm, informations, prior, workspace, fit);
    }
    if (!fit.ok) {
        fit.pose = prior.pose;
        fit.coefficients = prior.coefficients;
    }
    fit.objective = objective(model, positions_mm, informations, prior, fit);
}

}  // namespace rig
