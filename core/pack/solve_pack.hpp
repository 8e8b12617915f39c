// Everything precomputed for one performer and one rig, as core reads it: spans into the verified bytes of a
// pack.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "core/geometry/camera_model.hpp"
#include "core/geometry/mount_drift.hpp"
#include "core/limits.hpp"

namespace rig {

enum class SolverKind : std::uint8_t {
    kLeastSquares = 0,
    kNonNegative = 1,
    kBoxQp = 2,
    kRbf = 3,
    kKeyShapes = 4,  // per region: non-negative combinations of key shapes  [Chuang02 eq. 4]
    kExamples = 5,   // per region: convex combinations of examples          [Zhang06 eq. 1-5]
};
inline constexpr SolverKind kLastSolverKind = SolverKind::kExamples;

[[nodiscard]] constexpr bool is_regional(SolverKind solver) {
    return solver == SolverKind::kKeyShapes || solver == SolverKind::kExamples;
}

// phi of u = |x - c_k|^2 / width_k^2, the squared distance in widths:
//   Gaussian       exp(-u / 2)          the source's [Deng06 eq. 4]
//   thin plate     1/2 u ln u           = r^2 ln r with r in widths; 0 at the centre
//   multiquadric   sqrt(1 + u)
enum class RbfKernel : std::uint8_t { kGaussian = 0, kThinPlate = 1, kMultiquadric = 2 };

[[nodiscard]] constexpr std::string_view rbf_kernel_name(RbfKernel kernel) {
    constexpr std::array<std::string_view, 3> kNames{"gaussian", "thin-plate", "multiquadric"};
    const auto at = static_cast<std::size_t>(kernel);
    return at < kNames.size() ? kNames[at] : "unknown";
}

// RBF regression [Deng06 eq. 3-6]: x = basis (t - mean); h_k = phi(|x - c_k|^2 / width_k^2);
// w = weights^T h + offset.
struct RbfModel {
    RbfKernel kernel = RbfKernel::kGaussian;
    // Between these distances to the nearest centre, in its widths, the answer goes over from the
    // regression's to the box QP's. Both 0: the regression alone.
    float hull_near_widths = 0.0F;
    float hull_far_widths = 0.0F;       // > near, or 0
    std::uint16_t dimension_count = 0;  // d
    std::uint16_t centre_count = 0;     // K
    std::span<const float> mean_mm;     // [3m]
    std::span<const float> basis;       // [d x 3m] row-major, orthonormal rows
    std::span<const float> centres;     // [K x d] row-major, mm
    std::span<const float> widths_mm;   // [K], > 0
    std::span<const float> weights;     // [K x N] row-major
    std::span<const float> offset;      // [N]
};

enum class RegionSolver : std::uint8_t { kNonNegative = 0, kSimplex = 1 };

// A part of the face that is solved on its own: its markers as a combination of its examples,
//   p - origin = examples c,   shapes it asks for: sum_j c_j shapes_j.
// kNonNegative: c >= 0, origin the centroid of the region's neutral markers, the same for every marker.
// kSimplex: c >= 0 and sum c = 1, origin the mean example.
// Where regions meet, each streamed shape is blended linearly: w_i = sum over regions of shape_blend_i w_i.
struct RegionModel {
    std::string_view name;
    RegionSolver solver = RegionSolver::kNonNegative;
    std::uint16_t marker_count = 0;          // m_r, 1..m
    std::uint16_t example_count = 0;         // n_r, 1..kMaxRegionShapes
    std::span<const std::uint16_t> markers;  // [m_r] rising
    std::span<const float> marker_blend;     // [m_r] > 0; sums to 1 over the regions that share the marker
    std::span<const float> origin_mm;        // [3 m_r]
    std::span<const float> examples_mm;      // [3 m_r x padded(n_r)] row-major, zeros in the padding
    std::span<const float> shapes;           // [n_r x N] row-major: streamed weights of each example
    std::span<const float> shape_blend;  // [N] 0..1; sums to 1 over the regions, or to 0 for a shape of none
};

// How a set of markers moves together: a point of a face is neutral + d with
//   d = mean + modes c,   c_j ~ N(0, variance_j),
// and each coordinate strays from that by residual^2. Sets overlap and lie on levels, 0 the whole face, then
// ever smaller parts  [Zhang06 section 10].
struct MarkerSetModel {
    std::string_view name;
    std::uint8_t level = 0;                  // 0..kDeepestMarkerSetLevel
    std::uint16_t marker_count = 0;          // m_f, 1..m
    std::uint16_t mode_count = 0;            // k, 1..kMaxModes, at most 3 m_f
    std::span<const std::uint16_t> markers;  // [m_f] rising
    std::span<const float> mean_mm;          // [3 m_f] displacement from neutral
    std::span<const float> modes;            // [k x 3 m_f] row-major, orthonormal rows
    std::span<const float> variance_mm2;     // [k] > 0, falling
    std::span<const float> residual_mm2;     // [m_f] >= 0, of one coordinate of the marker
};
inline constexpr std::uint8_t kDeepestMarkerSetLevel = 2;

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
        temporal_gamma;             // [N] >= 0, mm^2: pull towards the previous solution, in units of E
    float noise_mm = 0.1F;          // s: standard deviation of one marker coordinate
    float sparsity_mm2 = 0.0F;      // beta: E += beta |w|_1             [Hybrid16 eq. 3]
    float ridge_mm2 = 0.0F;         // eps:  E += eps |w|^2              [Hybrid16 eq. 3]
    RbfModel rbf;                   // empty unless solver == kRbf
    std::uint8_t region_count = 0;  // 0 unless is_regional(solver)
    std::array<RegionModel, kMaxRegions> regions{};
    // 0 in packs that were trained without; then the rig's shapes and priors say how unseen markers move.
    // Levels rise; the first set is the only one on level 0 and holds every marker.
    std::uint8_t marker_set_count = 0;
    std::array<MarkerSetModel, kMaxMarkerSets> marker_sets{};

    std::uint8_t camera_count = 0;  // 0 for packs that only solve marker streams
    std::array<CameraModel, kMaxCameras> cameras{};

    // Dots fixed to the helmet, which tell whether a camera still sits as calibrated; 0 on rigs without.
    std::uint8_t reference_mark_count = 0;
    std::array<HelmetMark, kMaxReferenceMarks> reference_marks{};
    [[nodiscard]] std::span<const HelmetMark> helmet_marks() const {
        return std::span(reference_marks).first(reference_mark_count);
    }

    std::array<std::string_view, kMaxShapes> shape_names{};
    std::array<std::string_view, kMaxMarkers> marker_names{};
};

}  // namespace rig
