// How well each weight is known: the share of its prior spread that the markers seen take away.
//
//   P = (B^T V B / s^2 + P0^-1)^-1,   confidence_i = 1 - sqrt(P_ii / P0_ii)          (methods.md section 3)
//   of a region of shapes R:          confidence_R = 1 - sqrt(sum_R P_ii / sum_R P0_ii)
//
// The active set is ignored on purpose: with it, hiding a marker could raise a confidence; without it, never.
// P is kept from frame to frame and follows V by rank-one terms (Sherman and Morrison): a marker hidden adds
// a square to P, so that none of its diagonal can fall, not even by rounding. In double.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "core/base/linalg.hpp"
#include "core/base/math.hpp"
#include "core/limits.hpp"
#include "core/pack/solve_pack.hpp"
#include "core/solve/normal_equations.hpp"

namespace rig {

struct ConfidenceState {
    bool valid = false;                       // false: the next frame makes P anew
    std::uint16_t followed = 0;               // rank-one terms since P was made: their rounding adds up
    std::array<Mat3, kMaxMarkers> weights{};  // V that P was made with
    alignas(64) std::array<double, kMaxShapes * kMaxShapeStride> posterior{};  // P, rows row_stride(N) apart
};

struct ConfidenceWorkspace {
    alignas(64) std::array<double, kMaxShapes * kMaxShapeStride> factor{};
    alignas(64) std::array<double, kMaxShapeStride> term{};     // z = l^T B_k / s
    alignas(64) std::array<double, kMaxShapeStride> product{};  // P z
};

// Makes P follow the markers' V [m], finite. tables: as built from the pack. At most N / 6 markers that
// changed cost 6 N^2 operations each, more than those N^3 in all.
void follow_confidence(const SolvePack& pack, const NormalTables<double>& tables,
                       std::span<const Mat3> weights, ConfidenceState& state, ConfidenceWorkspace& workspace);

// 1 - sqrt(posterior / prior) of variances, 0..1; 0 where that is no number.
[[nodiscard]] inline float confidence_of(double posterior, double prior) {
    const double left = std::sqrt(posterior / prior);
    return is_finite(left) ? static_cast<float>(std::clamp(1.0 - left, 0.0, 1.0)) : 0.0F;
}

// confidence [N], 0..1; all zero when P is no covariance (V was not finite).
void read_confidence(const SolvePack& pack, const ConfidenceState& state, std::span<float> confidence);

// Of the shapes of a region by the confidence of each [N], 0..1; 0 for none.
[[nodiscard]] float region_confidence(std::span<const float> prior_sigma, std::span<const float> confidence,
                                      std::span<const std::size_t> shapes);

}  // namespace rig
