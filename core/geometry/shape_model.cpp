#include "core/geometry/shape_model.hpp"

#include <cmath>

#include "core/base/check.hpp"
#include "core/base/dense.hpp"

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

}  // namespace

Vec3 ShapeModel::face_position(std::size_t marker, std::span<const double> coefficients) const {
    Vec3 position = mean_mm[marker];
    const Vec3* row = modes.data() + marker * mode_count;
    for (std::size_t j = 0; j < mode_count; ++j) position += coefficients[j] * row[j];
    return position;
}

void round_modes(ShapeModel& model) {
    model.rows.fill(0.0F);
    model.columns.fill(0.0F);
    for (std::size_t k = 0; k < model.marker_count; ++k) {
        for (std::size_t j = 0; j < model.mode_count; ++j) {
            const Vec3& mode = model.modes[k * model.mode_count + j];
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const auto entry = static_cast<float>(mode[static_cast<Eigen::Index>(axis)]);
                model.rows[(3 * k + axis) * kMaxModes + j] = entry;
                model.columns[j * ShapeModel::kColumnStride + 3 * k + axis] = entry;
            }
        }
    }
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
    round_modes(model);
}

}  // namespace rig
