// The modes of the face given what a frame measured: the factor of their normal equations, the modes
// themselves, and how well single markers are known by them. Not for: what a sighting weighs and where a
// marker is put; that is inference.hpp's.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/infer/face_gaussian.hpp"

namespace rig {

// What a frame tells of one marker.
enum class MarkerKnowledge : std::uint8_t { kHidden = 0, kPartly = 1, kMeasured = 2 };

struct ModePosterior {
    static constexpr std::size_t kStride = row_stride(kMaxModes + kLaneFloats);
    static constexpr std::size_t kMostTerms = 64;  // squares added in one pass
    static constexpr std::size_t kTogether = 16;   // markers whose variances are found in one pass

    enum class Base : std::uint8_t { kNone = 0, kMeasuredFace = 1, kNothing = 2 };

    std::array<MarkerKnowledge, kMaxMarkers> knowledge{};
    std::array<Mat3, kMaxMarkers> weight{};  // W: what a marker's measurement says about its modes, 1/mm^2

    // The equations without the partly measured markers, kept while the markers in them are the same.
    Base base = Base::kNone;
    std::array<bool, kMaxMarkers> in_base{};  // hidden ones taken off, or measured ones put in
    std::array<double, kMaxModes * kMaxModes> base_equations{};

    std::array<double, kMaxModes * kStride> factor{};       // L^T of the normal equations L L^T, row-major
    std::array<double, kMaxModes> scale{};                  // 1 / L_ii
    std::array<float, kMaxModes * kMaxModes> unit_lower{};  // rows -L_ij / L_jj, j < i

    std::array<double, kMostTerms * kStride> terms{};
    std::array<double, kMostTerms> sign{};
    std::array<float, kMaxModes * 3 * kTogether> columns{};
    std::array<double, 3 * kMaxModes> narrowed{};
    std::array<double, kMaxModes> scratch{};
};

// To be called when the face has been built anew.
void reset_modes(ModePosterior& posterior);

// Factors A = I + sum_k M_k^T W_k M_k, W = posterior.weight [marker_count]: 0 of a hidden marker,
// measured_weight(k) I of a measured one, between these of a partly measured one. Summed, or what is missing
// taken off the sum of a face that is measured everywhere, by the number of markers of each knowledge. False
// when A is not positive definite to working precision. The answer does not depend on what was kept.
[[nodiscard]] bool factor_modes(const FaceGaussian& face, ModePosterior& posterior);

// x := A^-1 x, x [mode_count].
void solve_modes(const FaceGaussian& face, const ModePosterior& posterior, double* x);

// variance_mm2[k] of these markers: the trace of the covariance of x = M c + e given all measurements, its
// own too:  r K + K M A^-1 M^T K, K = I - r W.
void find_variances(const FaceGaussian& face, std::span<const std::uint16_t> markers,
                    ModePosterior& posterior, std::array<double, kMaxMarkers>& variance_mm2);

}  // namespace rig
