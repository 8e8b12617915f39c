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
#include "core/solve/normal_equations.hpp"
#include "core/solve/rbf.hpp"
#include "core/solve/regional.hpp"
#include "core/stabilise/stabilised_markers.hpp"

namespace rig {

struct SolverConfig {
    SolvePack pack;       // spans; the bytes outlive the solver
    NormalTables tables;  // built once
    BoxQpConfig qp;
    RegionalTables regional;  // of a regional pack
    double rate_hz = 60.0;
    double forget_s = 0.25;  // the temporal prior starts anew after a gap of this length
    std::array<float, kMaxShapes> full_confidence{};  // of each weight when every marker is seen
};

struct SolverState {
    BoxQpState qp;
    RegionalState regional;
    bool has_previous = false;
    std::int64_t previous_us = 0;
    std::array<double, kMaxShapes> previous{};
    // Confidence changes only with what is seen, so it is kept until that changes.
    bool has_confidence = false;
    std::array<Vec3, kMaxMarkers> seen_weight{};  // diagonals of the V behind it; zero: not seen
    std::array<float, kMaxShapes> confidence{};
};

struct SolverWorkspace {
    NormalEquations equations;
    BoxQpWorkspace qp;
    RbfWorkspace rbf;
    RegionalWorkspace regional;
    std::array<Vec3, kMaxMarkers> positions_mm{};
    std::array<Mat3, kMaxMarkers> weights{};
    std::array<double, kMaxShapes> low{};
    std::array<double, kMaxShapes> high{};
    ConfidenceWorkspace confidence;
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
    double kkt = 0.0;  // of the pack's problem at the answer, before any clamping of least squares
    double objective_mm2 =
        0.0;  // regional packs: the sum over regions, as iterations are; kkt is their worst
    std::uint16_t iterations = 0;
    std::uint16_t markers_used = 0;
    double residual_rms_mm = 0.0;
    double hull_distance = 0.0;  // RBF: distance to the nearest centre, in that centre's widths
};

// Not for frames: the workspace is only scratch here.
void configure_solver(const SolvePack& pack, double rate_hz, SolverWorkspace& workspace,
                      SolverConfig& config);
void reset_solver(SolverState& state);

void solve(const SolverConfig& config, const StabiliserOutput& stabilised, const InferenceOutput& completed,
           std::int64_t capture_us, SolverState& state, SolverWorkspace& workspace, SolverOutput& output,
           SolverReport& report);

}  // namespace rig
