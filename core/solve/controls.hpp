// What an artist asks of the solve, live: per shape sparsity, ridge, temporal pull, range, multiplier and
// offset; pairs that keep together and pairs that must not be on together.
//
// On the quadratic E of normal_equations.hpp, before the solve:
//
//   E'(w) = E(w) + sum_i (beta_i |w_i| + eps_i w_i^2 + g gamma_i (w_i - p_i)^2) + sum_(l,r) s_lr (w_l -
//   w_r)^2
//
//   beta_i  = (f - 1) beta   where the pack has a beta, else max(0, f - 1) 2 sqrt(2) s^2 / sigma_i
//             0 for shapes whose range goes below 0, as in E
//   eps_i   = (f - 1) eps    where the pack has an eps, else max(0, f - 1) s^2 / sigma_i^2
//   gamma_i = (f - 1) gamma  where the shape has one, else max(0, f - 1) 100 s^2 / sigma_i^2
//   s_lr    = strength (|b_l|^2 + |b_r|^2) / 2
//
// f: the artist's factor, 1 neutral, 0 none of it. g: 1 / frames since p. s: the pack's noise; sigma_i: its
// expected spread of the weight. What a pack does not regularise has nothing to scale, so a natural amount
// stands in: reading E / (2 s^2) as a negative log likelihood, a Laplace and a normal prior of that spread
// and a step of a tenth of it a frame. |b|: length of a column, so strength 1 pulls as hard as all markers
// hold. Ranges narrow the pack's own; where they lie outside it the nearest end of it stands.
//
// Cancel pairs. "Not both on" is no convex set, so: solve; in each pair, in the order in which they were set,
// the shape further from rest (0, or the end of its range next to it) stays and the other is fixed at rest;
// solve once more with those fixed. The one that stayed last time stays until the other is further from rest
// by a quarter and 0.02, so noise does not make them take turns; a shape that is off already does not stay
// against one that is on. A shape that gave way in an earlier pair gives way in later ones too. When nobody
// has to move, the first solve is the answer. This is not the best of all combinations; it is two solves,
// always the same.
//
// On the answer: w' = clamp(multiplier w + offset, range). A shape that gave way is at rest before this, so
// an offset shows on it.
//
// Solvers. Box QP, NNLS and least squares are that quadratic, and all controls act as above; a range that is
// narrower than the pack's bounds a shape even in least squares. RBF and the solvers by regions have none:
// their answer y is taken as a measurement, E = sum_i |b_i|^2 (w_i - y_i)^2, solved in the pack's ranges with
// the same terms. With neutral controls nothing of this runs and no bit changes. Confidence says what markers
// know and hears nothing of controls.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/bounded_vector.hpp"
#include "core/base/control_edit.hpp"
#include "core/base/result.hpp"
#include "core/limits.hpp"
#include "core/pack/solve_pack.hpp"

namespace rig {

struct ShapeControls {
    float sparsity = 1.0F;
    float ridge = 1.0F;
    float temporal = 1.0F;
    float multiplier = 1.0F;
    float offset = 0.0F;
    float low = -kMaxControlWeight;
    float high = kMaxControlWeight;
    bool operator==(const ShapeControls&) const = default;
};

struct SymmetryPair {
    std::uint16_t left = 0;
    std::uint16_t right = 0;
    float strength = 0.0F;
    bool operator==(const SymmetryPair&) const = default;
};

struct CancelPair {
    std::uint16_t first = 0;
    std::uint16_t second = 0;
    bool operator==(const CancelPair&) const = default;
};

// All controls of one face. Entries beyond the shapes of the pack are not looked at.
struct ControlSet {
    std::array<ShapeControls, kMaxShapes> shapes{};
    BoundedVector<SymmetryPair, kMaxControlPairs> symmetry;
    BoundedVector<CancelPair, kMaxControlPairs> cancel;
};

enum class ControlError : std::uint8_t {
    kValue,  // not finite or outside its limits
    kShape,  // the pack has no such shape, or a pair is of one shape
    kPairs,  // no room for another pair
};

// kValue, kShape, kPairs; `set` is as before then. A pair that is there already, either way round, is
// changed.
[[nodiscard]] Result<void, ControlError> edit_controls(const ControlEdit& edit, std::size_t shape_count,
                                                       ControlSet& set);
// Any numbers are safe.
[[nodiscard]] Result<void, ControlError> check_controls(const ControlSet& set, std::size_t shape_count);

// A checked set as a solve needs it, worked out once.
struct Controls {
    std::uint16_t shape_count = 0;
    std::uint32_t version = 0;     // +1 with each set: goes into whatever tells one Hessian from another
    bool acts_on_problem = false;  // false: H, q and the bounds stay as they are
    bool acts_on_output = false;
    BoundedVector<SymmetryPair, kMaxControlPairs> symmetry;
    BoundedVector<CancelPair, kMaxControlPairs> cancel;
    std::array<double, kMaxShapes> sparsity_mm2{};        // beta_i
    std::array<double, kMaxShapes> ridge_mm2{};           // eps_i
    std::array<double, kMaxShapes> temporal_mm2{};        // gamma_i
    std::array<double, kMaxControlPairs> symmetry_mm2{};  // s_lr
    std::array<double, kMaxShapes> data_mm2{};            // |b_i|^2, at least s^2 / sigma_i^2
    std::array<float, kMaxShapes> multiplier{};
    std::array<float, kMaxShapes> offset{};
    std::array<float, kMaxShapes> low{};  // inside the pack's range
    std::array<float, kMaxShapes> high{};
    std::array<bool, kMaxShapes> narrowed{};  // low or high is not the pack's
};

// Precondition: check_controls(set, pack.shape_count) holds. Not for frames: reads the whole basis.
void prepare_controls(const SolvePack& pack, const ControlSet& set, Controls& controls);

// Adds the terms to H, rows `stride` apart, both triangles. It changes only with `controls` and the scale.
void add_control_curvature(const Controls& controls, double gamma_scale, std::span<double> hessian,
                           std::size_t stride);
// Adds them to q and the constant of E. previous: p [N].
void add_control_pull(const Controls& controls, double gamma_scale, std::span<const double> previous,
                      std::span<double> linear, double& constant_mm2);

// E = sum_i |b_i|^2 (w_i - y_i)^2 as H, and as q and its constant, for a solver without a quadratic. What was
// there is overwritten, up to column `stride` in H.
void measurement_curvature(const Controls& controls, std::span<double> hessian, std::size_t stride);
void measurement_pull(const Controls& controls, std::span<const double> measured, std::span<double> linear,
                      double& constant_mm2);

// Narrows bounds to the ranges that were set, infinite ones too.
void narrow_bounds(const Controls& controls, std::span<double> low, std::span<double> high);

// Who stayed in each pair; belongs to a face, not to a set.
struct CancelState {
    std::uint32_t version = 0;                            // of the controls it was kept for
    std::array<std::uint8_t, kMaxControlPairs> winner{};  // 0 nobody yet, 1 first, 2 second
};

// After a solve: true when somebody has to give way; then low and high are equal for all who do, and the
// problem is to be solved once more. weights: [N], any.
[[nodiscard]] bool cancel_pairs(const Controls& controls, std::span<const double> weights,
                                std::span<double> low, std::span<double> high, CancelState& state);

// Multiplier, offset and range. weights: [N], finite; finite and in range afterwards.
void control_output(const Controls& controls, std::span<double> weights);

}  // namespace rig
