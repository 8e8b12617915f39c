#include "core/solve/solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/elapsed.hpp"
#include "core/base/math.hpp"

namespace rig {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::size_t fill_input(const SolverConfig& config, const StabiliserOutput& stabilised, SolverWorkspace& w) {
    const double s2 = static_cast<double>(config.pack.noise_mm) * static_cast<double>(config.pack.noise_mm);
    std::size_t seen = 0;
    for (std::size_t k = 0; k < config.pack.marker_count; ++k) {
        const StabilisedMarker& marker = stabilised.markers[k];
        w.positions_mm[k] = marker.position_mm;
        w.weights[k] = Mat3::Zero();
        if (!marker.seen) continue;
        ++seen;
        w.weights[k] = s2 * marker.information;
        // A 3D stream's marker comes back from the rotation within rounding of I: say so, it is the fast
        // case.
        if ((w.weights[k] - Mat3::Identity()).cwiseAbs().maxCoeff() < 1e-6) w.weights[k] = Mat3::Identity();
    }
    return seen;
}

void fill_bounds(const SolverConfig& config, SolverWorkspace& w) {
    for (std::size_t i = 0; i < config.pack.shape_count; ++i) {
        w.low[i] = static_cast<double>(config.pack.weight_low[i]);
        w.high[i] = static_cast<double>(config.pack.weight_high[i]);
        if (config.pack.solver == SolverKind::kLeastSquares) {
            w.low[i] = -kInfinity;
            w.high[i] = kInfinity;
        } else if (config.pack.solver == SolverKind::kNonNegative) {
            w.low[i] = 0.0;
            w.high[i] = kInfinity;
        }
    }
}

double gamma_scale(const SolverConfig& config, const SolverState& state, std::int64_t capture_us) {
    if (!state.has_previous) return 0.0;
    const double gap_s = static_cast<double>(elapsed_us(state.previous_us, capture_us)) * 1e-6;
    if (gap_s > config.forget_s || gap_s < 0.0) return 0.0;
    return 1.0 / std::max(1.0, gap_s * config.rate_hz);
}

constexpr double kSameInformation =
    0.05;  // of the trace: a ray turns by less while a marker moves about its place

// Confidence depends on what is seen and from where, not on where it is, so it is kept until that changes: a
// marker comes or goes, or a camera does.
void update_confidence(const SolverConfig& config, SolverState& state, SolverWorkspace& w) {
    const SolvePack& pack = config.pack;
    bool same = state.has_confidence;
    for (std::size_t k = 0; k < pack.marker_count && same; ++k) {
        const Vec3 now = w.weights[k].diagonal();
        const Vec3 change = now - state.seen_weight[k];
        same = change.cwiseAbs().maxCoeff() <= kSameInformation * now.sum();
    }
    if (same) return;
    for (std::size_t k = 0; k < pack.marker_count; ++k) state.seen_weight[k] = w.weights[k].diagonal();
    const ConfidenceInput input{w.equations.hessian, w.equations.data_diagonal, pack.prior_sigma,
                                static_cast<double>(pack.noise_mm)};
    weight_confidence(input, w.confidence, state.confidence);
    state.has_confidence = true;
}

void run_quadratic(const SolverConfig& config, SolverState& state, SolverWorkspace& w, SolverOutput& output,
                   SolverReport& report) {
    const std::size_t n = config.pack.shape_count;
    fill_bounds(config, w);
    const BoxQpProblem problem{n, w.equations.hessian, w.equations.linear, w.low, w.high};
    for (std::size_t i = 0; i < n; ++i) output.weights[i] = state.previous[i];
    const BoxQpReport qp = solve_box_qp(problem, config.qp, state.qp, w.qp, {output.weights.data(), n});
    report.optimal = qp.optimal;
    report.kkt = qp.kkt;
    report.iterations = qp.iterations;
    report.objective_mm2 = 2.0 * qp.objective + w.equations.constant_mm2;
}

void run_rbf(const SolverConfig& config, const InferenceOutput& completed, SolverWorkspace& w,
             SolverOutput& output, SolverReport& report) {
    for (std::size_t k = 0; k < config.pack.marker_count; ++k) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            w.flat_mm[3 * k + axis] =
                static_cast<float>(completed.position_mm[k][static_cast<Eigen::Index>(axis)]);
        }
    }
    const RbfReport rbf = evaluate_rbf(config.pack, {w.flat_mm.data(), 3U * config.pack.marker_count}, w.rbf,
                                       {output.weights.data(), config.pack.shape_count});
    report.optimal = true;
    report.hull_distance = rbf.nearest_widths;
}

void run_regional(const SolverConfig& config, SolverState& state, SolverWorkspace& w, SolverOutput& output,
                  SolverReport& report) {
    const SolvePack& pack = config.pack;
    const RegionalInput input{
        {w.positions_mm.data(), pack.marker_count}, {w.weights.data(), pack.marker_count}, output.confidence};
    solve_regions(pack, config.regional, input, state.regional, w.regional, w.qp, output.regional,
                  output.weights);
    report.optimal = true;
    for (std::size_t r = 0; r < pack.region_count; ++r) {
        const RegionReport& region = output.regional.regions[r];
        report.optimal = report.optimal && region.optimal;
        report.kkt = std::max(report.kkt, region.kkt);
        report.iterations = static_cast<std::uint16_t>(report.iterations + region.iterations);
        report.objective_mm2 += region.objective_mm2;
    }
}

}  // namespace

void configure_solver(const SolvePack& pack, double rate_hz, SolverWorkspace& workspace,
                      SolverConfig& config) {
    config.pack = pack;
    config.rate_hz = rate_hz;
    build_normal_tables(pack, config.tables);
    build_regional_tables(pack, config.regional);
    for (std::size_t i = 0; i < pack.shape_count; ++i) {
        workspace.equations.data_diagonal[i] = config.tables.full_gram[i * kMaxShapes + i];
    }
    const ConfidenceInput everything{config.tables.full_gram, workspace.equations.data_diagonal,
                                     pack.prior_sigma, static_cast<double>(pack.noise_mm)};
    weight_confidence(everything, workspace.confidence, config.full_confidence);
}

void reset_solver(SolverState& state) {
    state = SolverState{};
}

void solve(const SolverConfig& config, const StabiliserOutput& stabilised, const InferenceOutput& completed,
           std::int64_t capture_us, SolverState& state, SolverWorkspace& w, SolverOutput& output,
           SolverReport& report) {
    report = SolverReport{};
    const SolvePack& pack = config.pack;
    const std::size_t n = pack.shape_count;
    if (!state.has_previous) {
        for (std::size_t i = 0; i < n; ++i) {
            state.previous[i] = std::clamp(0.0, static_cast<double>(pack.weight_low[i]),
                                           static_cast<double>(pack.weight_high[i]));
        }
    }
    const std::size_t seen = fill_input(config, stabilised, w);
    NormalInput input;
    input.positions_mm = {w.positions_mm.data(), pack.marker_count};
    input.weights = {w.weights.data(), pack.marker_count};
    input.previous = {state.previous.data(), n};
    input.gamma_scale = gamma_scale(config, state, capture_us);
    build_normal_equations(pack, config.tables, input, w.equations);
    report.markers_used = static_cast<std::uint16_t>(w.equations.markers_used);
    update_confidence(config, state, w);
    output.confidence = state.confidence;
    if (seen < kMinMarkers) {
        output.weights = state.previous;
        return;
    }
    if (pack.solver == SolverKind::kRbf) {
        run_rbf(config, completed, w, output, report);
    } else if (is_regional(pack.solver)) {
        run_regional(config, state, w, output, report);
    } else {
        run_quadratic(config, state, w, output, report);
    }
    for (std::size_t i = 0; i < n; ++i) {
        if (!is_finite(output.weights[i])) output.weights[i] = state.previous[i];
        output.weights[i] = std::clamp(output.weights[i], static_cast<double>(pack.weight_low[i]),
                                       static_cast<double>(pack.weight_high[i]));
    }
    report.residual_rms_mm = residual_rms_mm(pack, config.tables, input, {output.weights.data(), n});
    report.solved = true;
    state.previous = output.weights;
    state.previous_us = capture_us;
    state.has_previous = true;
}

}  // namespace rig
