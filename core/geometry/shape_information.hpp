// What markers say about pose and expression of the Gaussian face: the matrix J^T W J of its fit and its
// factor, kept from fit to fit. Only markers whose knowledge changed are taken out and put in again. Not for:
// the gradient, which is exact in every step (shape_fit.hpp).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/float_kernels.hpp"
#include "core/geometry/shape_model.hpp"

namespace rig {

// Unknowns: the modes, then a turn (rad) and a shift (mm) of the face in its own frame.
struct ShapeInformation {
    static constexpr std::size_t kSize = kMaxModes + 6;
    static constexpr std::size_t kStride = row_stride(kSize);

    bool built = false;
    std::uint16_t changes = 0;                     // markers changed since it was built
    Mat3 rotation = Mat3::Identity();              // headset_from_face that turned the informations
    std::array<Mat3, kMaxMarkers> informations{};  // in the matrix, headset frame; zero: not in it
    std::array<Vec3, kMaxMarkers> positions_mm{};  // where the markers were put, face frame
    // Rows of the upper triangle; what lies left of the diagonal is not used.
    std::array<float, kSize * kStride> matrix{};
    std::array<float, 3 * kStride> weighted{};  // scratch: W J of one marker
};

// How far a marker may be from what is in the matrix before it is changed.
struct ShapeTolerance {
    double information_share = 0.1;  // of the largest entry
    double position_mm = 4.0;
    double rotation_rad = 0.05;  // of the whole face: beyond it all are put in anew
};

// Makes the matrix that of the face at `rotation` and `face_mm` with these informations (headset frame), to
// the tolerance. True when it changed.
bool follow_markers(const ShapeModel& model, const Mat3& rotation, std::span<const Vec3> face_mm,
                    std::span<const Mat3> informations, const ShapeTolerance& tolerance,
                    ShapeInformation& information);

// The factor of the matrix plus independent priors. The rows of the modes stay good while the matrix and
// their prior do.
struct ShapeFactor {
    static constexpr std::size_t kStride = row_stride(ShapeInformation::kSize + kLaneFloats);
    bool modes_done = false;
    double by_mode = 0.0;                                           // information of the modes' prior in it
    std::array<double, ShapeInformation::kSize * kStride> upper{};  // L^T of L L^T, row-major
};

struct ShapePriorInformation {
    double by_mode = 1.0;
    double by_rotation = 1.0;     // 1/rad^2
    double by_translation = 1.0;  // 1/mm^2
};

// False, and nothing to be used, when the sum is not positive definite to working precision.
[[nodiscard]] bool factor_shape(const ShapeInformation& information, std::size_t mode_count,
                                const ShapePriorInformation& prior, ShapeFactor& factor);

// x := (matrix + prior)^-1 x, x [mode_count + 6] and room for kLaneFloats more; returns x^T (matrix +
// prior)^-1 x of the old x.
[[nodiscard]] double solve_shape(const ShapeFactor& factor, std::size_t mode_count, double* x);

}  // namespace rig
