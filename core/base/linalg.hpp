// The one place that includes Eigen. Small fixed sizes only, unvectorised: Eigen's vector kernels change
// their summation order with the instruction set, and equal bits on every machine are part of the contract.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <span>

#ifndef EIGEN_DONT_VECTORIZE
#error "core is built with EIGEN_DONT_VECTORIZE; use rig_core_library() or link a core target"
#endif

namespace rig {

using Vec2 = Eigen::Matrix<double, 2, 1>;
using Vec3 = Eigen::Matrix<double, 3, 1>;
using Mat2 = Eigen::Matrix<double, 2, 2>;
using Mat3 = Eigen::Matrix<double, 3, 3>;

// Point k of coordinates that lie as x0, y0, z0, x1, ...
[[nodiscard]] inline Vec3 point_at(std::span<const float> rows, std::size_t k) {
    return {static_cast<double>(rows[3 * k]), static_cast<double>(rows[3 * k + 1]),
            static_cast<double>(rows[3 * k + 2])};
}

// Rigid motion y = rotation x + translation. Named b_from_a: takes coordinates in a to coordinates in b.
struct Rigid {
    Mat3 rotation = Mat3::Identity();
    Vec3 translation_mm = Vec3::Zero();

    [[nodiscard]] Vec3 apply(const Vec3& x) const { return rotation * x + translation_mm; }
    [[nodiscard]] Vec3 apply_inverse(const Vec3& y) const {
        return rotation.transpose() * (y - translation_mm);
    }
};

}  // namespace rig
