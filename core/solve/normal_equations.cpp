#include "core/solve/normal_equations.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"
#include "core/base/dense.hpp"

namespace rig {

namespace {

constexpr std::size_t kStride = kMaxShapes;

// Keeps H positive definite when shapes are invisible or dependent: far below what any marker can say.
constexpr double kDiagonalFloor = 1e-9;      // of the largest diagonal entry
constexpr double kSmallestDiagonal = 1e-12;  // mm^2, when nothing is seen at all

bool unseen(const Mat3& v) {
    return v(0, 0) == 0.0 && v(1, 1) == 0.0 && v(2, 2) == 0.0;
}

bool is_identity(const Mat3& v) {
    return (v - Mat3::Identity()).cwiseAbs().maxCoeff() == 0.0;
}

// H += sign * B_k^T B_k for one marker, lower triangle.
void add_plain_marker(const double* rows, std::size_t n, double sign, double* hessian) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double* row = rows + axis * kStride;
        for (std::size_t i = 0; i < n; ++i) {
            if (row[i] == 0.0) continue;
            add_scaled(hessian + i * kStride, sign * row[i], row, i + 1);
        }
    }
}

// H += B_k^T V B_k, lower triangle.
void add_weighted_marker(const double* rows, std::size_t n, const Mat3& v, double* hessian) {
    for (std::size_t i = 0; i < n; ++i) {
        const Vec3 b{rows[i], rows[kStride + i], rows[2 * kStride + i]};
        const Vec3 vb = v * b;
        if (vb[0] == 0.0 && vb[1] == 0.0 && vb[2] == 0.0) continue;
        double* out = hessian + i * kStride;
        for (std::size_t j = 0; j <= i; ++j) {
            out[j] += vb[0] * rows[j] + vb[1] * rows[kStride + j] + vb[2] * rows[2 * kStride + j];
        }
    }
}

// The Gram matrix of the seen markers: from the precomputed full one when few are missing and all are plain.
void data_hessian(const NormalTables& tables, const NormalInput& input, std::size_t n, NormalEquations& e) {
    const std::size_t m = input.weights.size();
    std::size_t missing = 0;
    bool plain = true;
    for (const Mat3& v : input.weights) {
        if (unseen(v)) {
            ++missing;
        } else {
            plain = plain && is_identity(v);
        }
    }
    const bool subtract = plain && 2 * missing < m;
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j <= i; ++j) {
            e.hessian[i * kStride + j] = subtract ? tables.full_gram[i * kStride + j] : 0.0;
        }
    }
    for (std::size_t k = 0; k < m; ++k) {
        const double* rows = tables.basis_mm.data() + 3 * k * kStride;
        const bool gone = unseen(input.weights[k]);
        if (subtract && gone) add_plain_marker(rows, n, -1.0, e.hessian.data());
        if (!subtract && !gone) add_weighted_marker(rows, n, input.weights[k], e.hessian.data());
    }
}

Vec3 neutral(const SolvePack& pack, std::size_t k) {
    return {static_cast<double>(pack.neutral_mm[3 * k]), static_cast<double>(pack.neutral_mm[3 * k + 1]),
            static_cast<double>(pack.neutral_mm[3 * k + 2])};
}

}  // namespace

void build_normal_tables(const SolvePack& pack, NormalTables& tables) {
    const std::size_t n = pack.shape_count;
    const std::size_t rows = 3U * pack.marker_count;
    RIG_CHECK(n <= kMaxShapes && rows <= kMaxRows && pack.basis_mm.size() == rows * n);
    for (std::size_t r = 0; r < rows; ++r) {
        for (std::size_t i = 0; i < n; ++i) {
            tables.basis_mm[r * kStride + i] = static_cast<double>(pack.basis_mm[r * n + i]);
        }
    }
    tables.full_gram.fill(0.0);
    for (std::size_t k = 0; k < pack.marker_count; ++k) {
        add_plain_marker(tables.basis_mm.data() + 3 * k * kStride, n, 1.0, tables.full_gram.data());
    }
}

void build_normal_equations(const SolvePack& pack, const NormalTables& tables, const NormalInput& input,
                            NormalEquations& e) {
    const std::size_t n = pack.shape_count;
    RIG_CHECK(input.positions_mm.size() == pack.marker_count && input.weights.size() == pack.marker_count);
    data_hessian(tables, input, n, e);
    std::fill_n(e.linear.begin(), n, 0.0);
    e.constant_mm2 = 0.0;
    e.markers_used = 0;
    for (std::size_t k = 0; k < pack.marker_count; ++k) {
        const Mat3& v = input.weights[k];
        if (unseen(v)) continue;
        ++e.markers_used;
        const Vec3 error = neutral(pack, k) - input.positions_mm[k];
        const Vec3 weighted = v * error;
        e.constant_mm2 += error.dot(weighted);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            add_scaled(e.linear.data(), weighted[static_cast<Eigen::Index>(axis)],
                       tables.basis_mm.data() + (3 * k + axis) * kStride, n);
        }
    }
    double largest = 0.0;
    for (std::size_t i = 0; i < n; ++i) largest = std::max(largest, e.hessian[i * kStride + i]);
    const double floor = kDiagonalFloor * largest + kSmallestDiagonal;
    for (std::size_t i = 0; i < n; ++i) {
        const double gamma = input.gamma_scale * static_cast<double>(pack.temporal_gamma[i]);
        const double previous = gamma > 0.0 ? input.previous[i] : 0.0;
        e.data_diagonal[i] = e.hessian[i * kStride + i];
        e.hessian[i * kStride + i] += static_cast<double>(pack.ridge_mm2) + gamma + floor;
        e.linear[i] += 0.5 * static_cast<double>(pack.sparsity_mm2) - gamma * previous;
        e.constant_mm2 += gamma * previous * previous;
        for (std::size_t j = 0; j < i; ++j) e.hessian[j * kStride + i] = e.hessian[i * kStride + j];
    }
}

double residual_rms_mm(const SolvePack& pack, const NormalTables& tables, const NormalInput& input,
                       std::span<const double> w) {
    double sum = 0.0;
    double coordinates = 0.0;
    for (std::size_t k = 0; k < pack.marker_count; ++k) {
        const Mat3& v = input.weights[k];
        if (unseen(v)) continue;
        Vec3 error = neutral(pack, k) - input.positions_mm[k];
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double* row = tables.basis_mm.data() + (3 * k + axis) * kStride;
            error[static_cast<Eigen::Index>(axis)] += dot(row, w.data(), pack.shape_count);
        }
        const Vec3 weighted = v * error;
        sum += error.dot(weighted);
        coordinates += v.trace();
    }
    return coordinates > 0.0 ? std::sqrt(sum / coordinates) : 0.0;
}

}  // namespace rig
