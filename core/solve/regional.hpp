// Faces by regions: every region's markers as a combination of its own examples, then the streamed shapes
// that those examples stand for, blended linearly where regions meet.
//
//   region r:  minimise sum_k v_k |p_k - origin - (E_r c_r)_k|^2,  c_r >= 0 [Chuang02 eq. 4]
//                                              or also sum c_r = 1           [Zhang06 eq. 1-5]
//   streamed:  w_i = sum_r blend_ri (shapes_r^T c_r)_i
//
//   v_k = marker blend times the diagonal of the marker's V: a marker that one camera sees counts across the
//         ray as far as the ray is along an axis; what is off the diagonal is left out
//
// Which region holds which markers and what its examples are is the pack's; training is the host's.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/linalg.hpp"
#include "core/pack/solve_pack.hpp"
#include "core/solve/nnls.hpp"
#include "core/solve/simplex_qp.hpp"

namespace rig {

inline constexpr std::size_t kRegionGramSize = kMaxRegionShapes * kSimplexStride;

// What the pack lets us compute before the first frame: E^T E of every simplex region, for V = I.
struct RegionalTables {
    alignas(64) std::array<std::array<float, kRegionGramSize>, kMaxRegions> gram{};
};

void build_regional_tables(const SolvePack& pack, RegionalTables& tables);

struct RegionalInput {
    std::span<const Vec3> positions_mm;  // face frame [m]; not finite: not seen
    std::span<const Mat3> weights;       // V [m]; zero: not seen
    std::span<const float> confidence;   // of the streamed weights [N], see confidence.hpp
};

struct RegionState {
    SimplexQpState simplex;
    NnlsState nnls;
    bool has_gram = false;
    std::array<double, kMaxRegionShapes * kMaxRegionShapes> gram{};  // E^T V E of the V below
    std::array<float, kMaxRows> row_weight{};
};

struct RegionalState {
    std::array<RegionState, kMaxRegions> regions{};
};

struct RegionalWorkspace {
    SimplexQpWorkspace simplex;
    NnlsWorkspace nnls;
    std::array<float, kMaxRows> target_mm{};
    std::array<float, kMaxRows> row_weight{};
    std::array<double, kMaxRegionShapes> linear{};
    std::array<double, kMaxRegionShapes> weights{};
    alignas(64) std::array<float, kSimplexStride> coefficients{};
};

struct RegionReport {
    double kkt = 0.0;
    double residual_rms_mm = 0.0;  // over the coordinates seen, by their weights
    double objective_mm2 = 0.0;    // sum of v |p - origin - E c|^2
    float confidence = 0.0F;       // of the shapes it drives: hiding a marker never raises it
    std::uint16_t iterations = 0;
    std::uint16_t changes = 0;    // of the working set
    std::uint16_t rows_used = 0;  // 0: nothing of it was seen, and its last coefficients stay
    bool optimal = false;
};

struct RegionalOutput {
    // Of key shapes or examples: what a retargeting to another face's shapes takes [Chuang02 section 5].
    std::array<std::array<float, kMaxRegionShapes>, kMaxRegions> coefficients{};
    std::array<RegionReport, kMaxRegions> regions{};
};

// The next frame starts cold and remembers no coefficients.
void reset_regions(RegionalState& state);

// Solves every region of the pack. shape_weights [N]: finite, not clamped to the pack's ranges. Bounded work.
void solve_regions(const SolvePack& pack, const RegionalTables& tables, const RegionalInput& input,
                   RegionalState& state, RegionalWorkspace& workspace, RegionalOutput& output,
                   std::span<double> shape_weights);

}  // namespace rig
