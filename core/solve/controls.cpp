#include "core/solve/controls.hpp"

#include <algorithm>

#include "core/base/check.hpp"
#include "core/base/math.hpp"

namespace rig {

namespace {

constexpr double kLaplaceUnit = 2.8284271247461903;  // 2 sqrt(2)
constexpr double kStepsPerSpread = 10.0;             // a step of a tenth of the spread a frame
constexpr double kOff = 1e-6;                        // of a weight: no one sees less
constexpr double kSwitchFactor = 1.25;
constexpr double kSwitchMargin = 0.02;

bool within(float x, float low, float high) {
    return x >= low && x <= high;  // false for NaN
}

bool is_valid(const ShapeControls& shape) {
    for (const float factor : {shape.sparsity, shape.ridge, shape.temporal}) {
        if (!within(factor, 0.0F, kMaxControlFactor)) return false;
    }
    return within(shape.multiplier, -kMaxControlFactor, kMaxControlFactor) &&
           within(shape.offset, -kMaxControlWeight, kMaxControlWeight) &&
           within(shape.low, -kMaxControlWeight, shape.high) && shape.high <= kMaxControlWeight;
}

void edit_shape(const ControlEdit& edit, ShapeControls& shape) {
    switch (edit.kind) {
        case ControlKind::kSparsity:
            shape.sparsity = edit.value;
            break;
        case ControlKind::kRidge:
            shape.ridge = edit.value;
            break;
        case ControlKind::kTemporal:
            shape.temporal = edit.value;
            break;
        case ControlKind::kMultiplier:
            shape.multiplier = edit.value;
            break;
        case ControlKind::kOffset:
            shape.offset = edit.value;
            break;
        case ControlKind::kRange:
            shape.low = edit.value;
            shape.high = edit.high;
            break;
        case ControlKind::kSymmetry:
        case ControlKind::kCancel:
            break;
    }
}

// Puts a pair in the place of the one of the same two shapes, or behind the last, or takes it away; the
// others keep their order. `ends`: the two shapes of a pair.
template <class Pair, class Ends>
Result<void, ControlError> set_pair(const Pair& pair, bool present,
                                    BoundedVector<Pair, kMaxControlPairs>& pairs, Ends ends) {
    const auto [a, b] = ends(pair);
    std::size_t at = 0;
    for (; at < pairs.size(); ++at) {
        const auto [c, d] = ends(pairs[at]);
        if ((a == c && b == d) || (a == d && b == c)) break;
    }
    if (at < pairs.size() && present) pairs[at] = pair;
    if (at < pairs.size() && !present) {
        for (std::size_t k = at + 1; k < pairs.size(); ++k) pairs[k - 1] = pairs[k];
        pairs.pop_back();
    }
    if (at == pairs.size() && present && !pairs.push_back(pair)) return failure(ControlError::kPairs);
    return {};
}

double added(float factor, double of_pack, double natural) {
    const double more = static_cast<double>(factor) - 1.0;
    return of_pack > 0.0 ? more * of_pack : std::max(more, 0.0) * natural;
}

void measure_columns(const SolvePack& pack, Controls& controls) {
    const std::size_t n = pack.shape_count;
    const double s2 = static_cast<double>(pack.noise_mm) * static_cast<double>(pack.noise_mm);
    for (std::size_t i = 0; i < n; ++i) controls.data_mm2[i] = 0.0;
    for (std::size_t r = 0; r < 3U * pack.marker_count; ++r) {
        for (std::size_t i = 0; i < n; ++i) {
            const auto b = static_cast<double>(pack.basis_mm[r * n + i]);
            controls.data_mm2[i] += b * b;
        }
    }
    for (std::size_t i = 0; i < n; ++i) {
        const auto sigma = static_cast<double>(pack.prior_sigma[i]);
        controls.data_mm2[i] = std::max(controls.data_mm2[i], s2 / (sigma * sigma));
    }
}

void prepare_shape(const SolvePack& pack, const ShapeControls& shape, std::size_t i, Controls& controls) {
    const double s2 = static_cast<double>(pack.noise_mm) * static_cast<double>(pack.noise_mm);
    const auto sigma = static_cast<double>(pack.prior_sigma[i]);
    const double tikhonov = s2 / (sigma * sigma);
    const bool one_sided = pack.weight_low[i] >= 0.0F;
    controls.sparsity_mm2[i] =
        one_sided ? added(shape.sparsity, static_cast<double>(pack.sparsity_mm2), kLaplaceUnit * s2 / sigma)
                  : 0.0;
    controls.ridge_mm2[i] = added(shape.ridge, static_cast<double>(pack.ridge_mm2), tikhonov);
    controls.temporal_mm2[i] = added(shape.temporal, static_cast<double>(pack.temporal_gamma[i]),
                                     kStepsPerSpread * kStepsPerSpread * tikhonov);
    controls.multiplier[i] = shape.multiplier;
    controls.offset[i] = shape.offset;
    controls.low[i] = std::clamp(shape.low, pack.weight_low[i], pack.weight_high[i]);
    controls.high[i] = std::clamp(shape.high, pack.weight_low[i], pack.weight_high[i]);
    controls.narrowed[i] = controls.low[i] != pack.weight_low[i] || controls.high[i] != pack.weight_high[i];
    controls.acts_on_problem = controls.acts_on_problem || controls.sparsity_mm2[i] != 0.0 ||
                               controls.ridge_mm2[i] != 0.0 || controls.temporal_mm2[i] != 0.0 ||
                               controls.narrowed[i];
    controls.acts_on_output =
        controls.acts_on_output || controls.narrowed[i] || shape.multiplier != 1.0F || shape.offset != 0.0F;
}

double rest_of(std::span<const double> low, std::span<const double> high, std::size_t i) {
    return std::clamp(0.0, low[i], high[i]);
}

// 1 or 2: who stays, by how far each is from rest.
std::uint8_t winner_of(double first, double second, std::uint8_t before) {
    if (first <= kOff && second <= kOff) return before == 0 ? std::uint8_t{1} : before;
    if (second <= kOff) return 1;
    if (first <= kOff) return 2;
    if (before == 1) return second > kSwitchFactor * first + kSwitchMargin ? 2 : 1;
    if (before == 2) return first > kSwitchFactor * second + kSwitchMargin ? 1 : 2;
    return first >= second ? 1 : 2;
}

}  // namespace

Result<void, ControlError> edit_controls(const ControlEdit& edit, std::size_t shape_count, ControlSet& set) {
    if (!is_valid(edit)) return failure(ControlError::kValue);
    if (is_pair(edit.kind)) {
        if (edit.first >= shape_count || edit.second >= shape_count) return failure(ControlError::kShape);
        if (edit.kind == ControlKind::kSymmetry) {
            return set_pair(SymmetryPair{edit.first, edit.second, edit.value}, edit.value > 0.0F,
                            set.symmetry, [](const SymmetryPair& p) { return std::pair(p.left, p.right); });
        }
        return set_pair(CancelPair{edit.first, edit.second}, edit.value > 0.0F, set.cancel,
                        [](const CancelPair& p) { return std::pair(p.first, p.second); });
    }
    for (std::size_t i = shape_count; i < kMaxShapes; ++i) {
        if (is_in(edit.shapes, i)) return failure(ControlError::kShape);
    }
    for (std::size_t i = 0; i < shape_count; ++i) {
        if (is_in(edit.shapes, i)) edit_shape(edit, set.shapes[i]);
    }
    return {};
}

Result<void, ControlError> check_controls(const ControlSet& set, std::size_t shape_count) {
    if (shape_count > kMaxShapes) return failure(ControlError::kShape);
    for (std::size_t i = 0; i < shape_count; ++i) {
        if (!is_valid(set.shapes[i])) return failure(ControlError::kValue);
    }
    for (const SymmetryPair& pair : set.symmetry) {
        if (!within(pair.strength, 0.0F, kMaxControlFactor)) return failure(ControlError::kValue);
        if (pair.left >= shape_count || pair.right >= shape_count || pair.left == pair.right)
            return failure(ControlError::kShape);
    }
    for (const CancelPair& pair : set.cancel) {
        if (pair.first >= shape_count || pair.second >= shape_count || pair.first == pair.second)
            return failure(ControlError::kShape);
    }
    return {};
}

void prepare_controls(const SolvePack& pack, const ControlSet& set, Controls& controls) {
    const std::size_t n = pack.shape_count;
    RIG_CHECK(check_controls(set, n).has_value() && pack.basis_mm.size() == 3U * pack.marker_count * n);
    ++controls.version;
    controls.shape_count = pack.shape_count;
    controls.acts_on_problem = !set.cancel.empty();
    controls.acts_on_output = false;
    controls.symmetry = set.symmetry;
    controls.cancel = set.cancel;
    measure_columns(pack, controls);
    for (std::size_t i = 0; i < n; ++i) prepare_shape(pack, set.shapes[i], i, controls);
    for (std::size_t k = 0; k < set.symmetry.size(); ++k) {
        const SymmetryPair& pair = set.symmetry[k];
        controls.symmetry_mm2[k] = static_cast<double>(pair.strength) * 0.5 *
                                   (controls.data_mm2[pair.left] + controls.data_mm2[pair.right]);
        controls.acts_on_problem = controls.acts_on_problem || pair.strength > 0.0F;
    }
}

void add_control_curvature(const Controls& controls, double gamma_scale, std::span<double> hessian,
                           std::size_t stride) {
    for (std::size_t i = 0; i < controls.shape_count; ++i) {
        hessian[i * stride + i] += controls.ridge_mm2[i] + gamma_scale * controls.temporal_mm2[i];
    }
    for (std::size_t k = 0; k < controls.symmetry.size(); ++k) {
        const std::size_t l = controls.symmetry[k].left;
        const std::size_t r = controls.symmetry[k].right;
        const double pull = controls.symmetry_mm2[k];
        hessian[l * stride + l] += pull;
        hessian[r * stride + r] += pull;
        hessian[l * stride + r] -= pull;
        hessian[r * stride + l] -= pull;
    }
}

void add_control_pull(const Controls& controls, double gamma_scale, std::span<const double> previous,
                      std::span<double> linear, double& constant_mm2) {
    for (std::size_t i = 0; i < controls.shape_count; ++i) {
        const double gamma = gamma_scale * controls.temporal_mm2[i];
        const double p = gamma != 0.0 ? previous[i] : 0.0;
        linear[i] += 0.5 * controls.sparsity_mm2[i] - gamma * p;
        constant_mm2 += gamma * p * p;
    }
}

void measurement_curvature(const Controls& controls, std::span<double> hessian, std::size_t stride) {
    const std::size_t n = controls.shape_count;
    for (std::size_t i = 0; i < n * stride; ++i) hessian[i] = 0.0;
    for (std::size_t i = 0; i < n; ++i) hessian[i * stride + i] = controls.data_mm2[i];
}

void measurement_pull(const Controls& controls, std::span<const double> measured, std::span<double> linear,
                      double& constant_mm2) {
    constant_mm2 = 0.0;
    for (std::size_t i = 0; i < controls.shape_count; ++i) {
        const double information = controls.data_mm2[i];
        linear[i] = -information * measured[i];
        constant_mm2 += information * measured[i] * measured[i];
    }
}

void narrow_bounds(const Controls& controls, std::span<double> low, std::span<double> high) {
    for (std::size_t i = 0; i < controls.shape_count; ++i) {
        if (!controls.narrowed[i]) continue;
        high[i] = std::min(high[i], static_cast<double>(controls.high[i]));
        low[i] = std::min(std::max(low[i], static_cast<double>(controls.low[i])), high[i]);
    }
}

bool cancel_pairs(const Controls& controls, std::span<const double> weights, std::span<double> low,
                  std::span<double> high, CancelState& state) {
    if (controls.cancel.empty()) return false;
    if (state.version != controls.version) state = CancelState{.version = controls.version, .winner = {}};
    std::array<bool, kMaxShapes> gives_way{};
    bool again = false;
    const auto distance = [&](std::size_t i) {
        const double from_rest = weights[i] - rest_of(low, high, i);
        return from_rest < 0.0 ? -from_rest : from_rest;
    };
    for (std::size_t k = 0; k < controls.cancel.size(); ++k) {
        const CancelPair& pair = controls.cancel[k];
        state.winner[k] = winner_of(distance(pair.first), distance(pair.second), state.winner[k]);
        if (gives_way[pair.first] || gives_way[pair.second]) continue;
        const std::size_t loser = state.winner[k] == 1 ? pair.second : pair.first;
        gives_way[loser] = true;
        again = again || distance(loser) > 0.0;
    }
    if (!again) return false;
    for (std::size_t i = 0; i < controls.shape_count; ++i) {
        if (gives_way[i]) low[i] = high[i] = rest_of(low, high, i);
    }
    return true;
}

void control_output(const Controls& controls, std::span<double> weights) {
    RIG_CHECK(weights.size() == controls.shape_count);
    if (!controls.acts_on_output) return;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        if (controls.multiplier[i] != 1.0F || controls.offset[i] != 0.0F) {
            weights[i] = static_cast<double>(controls.multiplier[i]) * weights[i] +
                         static_cast<double>(controls.offset[i]);
        }
        weights[i] = std::clamp(weights[i], static_cast<double>(controls.low[i]),
                                static_cast<double>(controls.high[i]));
    }
}

}  // namespace rig
