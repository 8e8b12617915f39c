// The solve stage: markers in the face frame -> weights, with a certificate and a confidence for each weight.
// Chooses the solver that the pack names; the mathematics of each is in its own file.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/geometry/shape_model.hpp"
#include "core/infer/completed_markers.hpp"
#include "core/pack/solve_pack.hpp"
#include "core/solve/box_qp.hpp"
#include "core/solve/confidence.hpp"
#include "core/solve/controls.hpp"
#include "core/solve/normal_equations.hpp"
#include "core/solve/rbf.hpp"
#include "core/solve/regional.hpp"
#include "core/stabilise/stabilised_markers.hpp"

namespace rig {

// One precision's share of the stage. Float where ridge and pull keep the problem well posed, double where
// they do not: least squares and NNLS as their sources have them, and the first frame after a loss.
template <typename Real>
struct QuadraticState {
    NormalState<Real> normal;
    BoxQpState<Real> qp;
};
template <typename Real>
struct QuadraticWorkspace {
    NormalEquations<Real> equations;
    BoxQpWorkspace<Real> qp;
    alignas(64) std::array<Real, kMaxShapeStride> weights{};
    std::array<Real, kMaxShapes> low{};
    std::array<Real, kMaxShapes> high{};
};

// The quadratic with the artist's terms on it, kept beside the pack's own while controls act: H changes when
// they do or what is seen does. Always in double: a control may take every ridge away.
struct ControlledState {
    bool valid = false;
    std::uint32_t version = 0;  // of H, and what it was made of:
    std::uint32_t normal_version = 0;
    std::uint32_t controls_version = 0;
    double gamma_scale = 0.0;
    alignas(64) std::array<double, kMaxShapes * kMaxShapeStride> hessian{};
    BoxQpState<double> qp;
    CancelState cancel;
};

struct SolverConfig {
    SolvePack pack;              // spans; the bytes outlive the solver
    NormalTables<float> tables;  // built once
    NormalTables<double> precise_tables;
    RegionalTables regional;   // of a regional pack
    double ridge_share = 0.0;  // ridge and least pull, relative to the mean diagonal of B^T B
    double pull_share = 0.0;
    RbfTables rbf;  // of an RBF pack; its hull_share asks for the quadratic
    BoxQpConfig qp;
    BoxQpConfig precise_qp{.tolerance = 1e-9};
    Controls controls;  // neutral after configure_solver(); may be prepared anew between frames
    double rate_hz = 60.0;
    double forget_s = 0.25;  // the temporal prior starts anew after a gap of this length
    std::array<float, kMaxShapes> full_confidence{};  // of each weight when every marker is seen
};

struct SolverState {
    QuadraticState<float> quadratic;
    QuadraticState<double> precise;
    RegionalState regional;
    ControlledState controlled;
    bool has_previous = false;
    std::int64_t previous_us = 0;
    std::array<double, kMaxShapes> previous{};
    ConfidenceState posterior;
    std::array<float, kMaxShapes> confidence{};
};

struct SolverWorkspace {
    QuadraticWorkspace<float> quadratic;
    QuadraticWorkspace<double> precise;
    RbfWorkspace rbf;
    std::array<float, kMaxShapes> rbf_weights{};
    RegionalWorkspace regional;
    std::array<Vec3, kMaxMarkers> positions_mm{};
    std::array<Mat3, kMaxMarkers> weights{};
    ConfidenceWorkspace confidence;
    ConfidenceState full_posterior;  // of set-up
    std::array<float, kMaxRows> flat_mm{};
};

struct SolverOutput {
    std::array<double, kMaxShapes> weights{};    // inside [low, high] of the pack
    std::array<float, kMaxShapes> confidence{};  // 0..1, see confidence.hpp
    RegionalOutput regional;                     // of a regional pack: coefficients and certificates
};

struct SolverReport {
    bool solved = false;  // false: nothing was seen; weights are the previous ones, or the rest pose
    bool optimal = false;
    double kkt = 0.0;            // of the pack's problem at the answer, before any clamping of least squares
    double objective_mm2 = 0.0;  // regional packs: the sum over regions, as iterations; kkt is their worst
    std::uint16_t iterations = 0;
    std::uint16_t changes = 0;  // of the working set
    std::uint16_t markers_used = 0;
    // Multiply-adds of H and of the QP: at most normal_work_cap(m, N) + box_qp_work_cap(N), or twice the
    // latter when shapes cancel each other, three times when an RBF also falls back.
    std::uint64_t work = 0;
    double residual_rms_mm = 0.0;
    double hull_distance = 0.0;  // RBF: distance to the nearest centre, in that centre's widths
    // RBF: share of the box QP in the answer, 0 unless the pack has a fallback. Where it is not 0, the
    // certificate (optimal, kkt, objective, iterations) is the QP's, at its own answer.
    double hull_share = 0.0;
};

// Not for frames: the workspace is only scratch here.
void configure_solver(const SolvePack& pack, double rate_hz, SolverWorkspace& workspace,
                      SolverConfig& config);
void reset_solver(SolverState& state);

void solve(const SolverConfig& config, const StabiliserOutput& stabilised, const InferenceOutput& completed,
           std::int64_t capture_us, SolverState& state, SolverWorkspace& workspace, SolverOutput& output,
           SolverReport& report);

}  // namespace rig
