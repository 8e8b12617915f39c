#include "core/solve/solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/elapsed.hpp"
#include "core/base/math.hpp"

namespace rig {

namespace {

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

template <typename Real>
void fill_bounds(const SolvePack& pack, QuadraticWorkspace<Real>& w) {
    constexpr Real kInfinity = std::numeric_limits<Real>::infinity();
    for (std::size_t i = 0; i < pack.shape_count; ++i) {
        w.low[i] = static_cast<Real>(pack.weight_low[i]);
        w.high[i] = static_cast<Real>(pack.weight_high[i]);
        if (pack.solver == SolverKind::kLeastSquares) {
            w.low[i] = -kInfinity;
            w.high[i] = kInfinity;
        } else if (pack.solver == SolverKind::kNonNegative) {
            w.low[i] = Real(0);
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

// Confidence depends on what is seen and from where, not on where it is, so it is kept until that changes.
template <typename Real>
void update_confidence(const SolverConfig& config, const NormalState<Real>& normal, SolverState& state,
                       SolverWorkspace& w) {
    follow_confidence(config.pack, config.precise_tables, {normal.weights.data(), config.pack.marker_count},
                      state.posterior, w.confidence);
    read_confidence(config.pack, state.posterior, state.confidence);
}

template <typename Real>
BoxQpProblem<Real> pack_problem(const SolverConfig& config, const NormalState<Real>& normal,
                                QuadraticWorkspace<Real>& w) {
    const std::size_t n = config.pack.shape_count;
    fill_bounds(config.pack, w);
    return {n,      row_stride(n), {normal.hessian.data(), n * row_stride(n)}, w.equations.linear, w.low,
            w.high, normal.version};
}

void add_certificate(const BoxQpReport& qp, double constant_mm2, SolverReport& report) {
    report.optimal = qp.optimal;
    report.kkt = qp.kkt;
    report.iterations = static_cast<std::uint16_t>(report.iterations + qp.iterations);
    report.changes = static_cast<std::uint16_t>(report.changes + qp.changes);
    report.work += qp.work;
    report.objective_mm2 = 2.0 * qp.objective + constant_mm2;
}

template <typename Real>
void run_quadratic(const SolverConfig& config, const BoxQpProblem<Real>& problem, const SolverState& state,
                   BoxQpState<Real>& qp, QuadraticWorkspace<Real>& w, SolverOutput& output,
                   SolverReport& report) {
    const std::size_t n = problem.size;
    for (std::size_t i = 0; i < n; ++i) w.weights[i] = static_cast<Real>(state.previous[i]);
    const BoxQpReport solved =
        solve_box_qp(problem, sizeof(Real) == sizeof(float) ? config.qp : config.precise_qp, qp, w.qp,
                     std::span<Real>(w.weights.data(), n));
    for (std::size_t i = 0; i < n; ++i) output.weights[i] = static_cast<double>(w.weights[i]);
    add_certificate(solved, w.equations.constant_mm2, report);
}

// H with the artist's terms; normal: null when the answer of a solver without a quadratic is the measurement.
void follow_controls(const SolverConfig& config, const NormalState<double>* normal, double gamma_scale,
                     ControlledState& c) {
    const std::size_t n = config.pack.shape_count;
    const std::size_t stride = row_stride(n);
    const std::uint32_t normal_version = normal != nullptr ? normal->version : 0;
    if (c.valid && c.normal_version == normal_version && c.controls_version == config.controls.version &&
        c.gamma_scale == gamma_scale)
        return;
    const std::span<double> hessian(c.hessian.data(), n * stride);
    if (normal != nullptr) {
        std::copy_n(normal->hessian.begin(), n * stride, hessian.begin());
    } else {
        measurement_curvature(config.controls, hessian, stride);
    }
    add_control_curvature(config.controls, gamma_scale, hessian, stride);
    c.valid = true;
    ++c.version;
    c.normal_version = normal_version;
    c.controls_version = config.controls.version;
    c.gamma_scale = gamma_scale;
}

// output.weights: the measurement when `normal` is null.
void run_controlled(const SolverConfig& config, const NormalState<double>* normal, double gamma_scale,
                    SolverState& state, QuadraticWorkspace<double>& w, SolverOutput& output,
                    SolverReport& report) {
    const std::size_t n = config.pack.shape_count;
    ControlledState& c = state.controlled;
    follow_controls(config, normal, gamma_scale, c);
    NormalEquations<double>& e = w.equations;
    if (normal == nullptr) measurement_pull(config.controls, output.weights, e.linear, e.constant_mm2);
    add_control_pull(config.controls, gamma_scale, state.previous, e.linear, e.constant_mm2);
    fill_bounds(config.pack, w);
    narrow_bounds(config.controls, w.low, w.high);
    const std::size_t stride = row_stride(n);
    const BoxQpProblem<double> problem{n,      stride,   {c.hessian.data(), n * stride}, e.linear, w.low,
                                       w.high, c.version};
    run_quadratic(config, problem, state, c.qp, w, output, report);
    if (cancel_pairs(config.controls, output.weights, w.low, w.high, c.cancel)) {
        run_quadratic(config, problem, state, c.qp, w, output, report);
    }
}

// w.rbf_weights: what the references say; report.hull_share: how far the face is from them.
void run_rbf(const SolverConfig& config, const InferenceOutput& completed, SolverWorkspace& w,
             SolverReport& report) {
    for (std::size_t k = 0; k < config.pack.marker_count; ++k) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            w.flat_mm[3 * k + axis] =
                static_cast<float>(completed.position_mm[k][static_cast<Eigen::Index>(axis)]);
        }
    }
    const RbfReport rbf = evaluate_rbf(config.rbf, {w.flat_mm.data(), config.rbf.rows}, w.rbf,
                                       {w.rbf_weights.data(), config.pack.shape_count});
    report.optimal = true;
    report.hull_distance = static_cast<double>(rbf.nearest_widths);
    report.hull_share = static_cast<double>(rbf.hull_share);
}

// w = (1 - a) w_rbf + a w_qp, a rising smoothly with the distance from the references [ours; methods.md 3.2].
void blend_rbf(std::span<const float> references, double share, SolverOutput& output) {
    for (std::size_t i = 0; i < references.size(); ++i) {
        const auto reference = static_cast<double>(references[i]);
        output.weights[i] = share > 0.0 ? reference + share * (output.weights[i] - reference) : reference;
    }
}

void run_regional(const SolverConfig& config, SolverState& state, SolverWorkspace& w, SolverOutput& output,
                  SolverReport& report) {
    const SolvePack& pack = config.pack;
    const RegionalInput input{
        {w.positions_mm.data(), pack.marker_count}, {w.weights.data(), pack.marker_count}, output.confidence};
    solve_regions(pack, config.regional, input, state.regional, w.regional, output.regional, output.weights);
    report.optimal = true;
    for (std::size_t r = 0; r < pack.region_count; ++r) {
        const RegionReport& region = output.regional.regions[r];
        report.optimal = report.optimal && region.optimal;
        report.kkt = std::max(report.kkt, region.kkt);
        report.iterations = static_cast<std::uint16_t>(report.iterations + region.iterations);
        report.changes = static_cast<std::uint16_t>(report.changes + region.changes);
        report.objective_mm2 += region.objective_mm2;
    }
}

// Below this share of the mean diagonal of B^T B, ridge and pull leave float's inverse to wear out.
constexpr double kFirmShare = 1e-4;

void measure_firmness(const SolvePack& pack, SolverConfig& config) {
    double sum = 0.0;
    for (const float b : pack.basis_mm) sum += static_cast<double>(b) * static_cast<double>(b);
    float least = pack.shape_count > 0 ? pack.temporal_gamma[0] : 0.0F;
    for (const float gamma : pack.temporal_gamma) least = std::min(least, gamma);
    const double mean = std::max(sum / static_cast<double>(pack.shape_count), 1e-12);
    config.ridge_share = static_cast<double>(pack.ridge_mm2) / mean;
    config.pull_share = static_cast<double>(least) / mean;
}

// With every marker seen as the pack's noise says.
void measure_full_confidence(SolverWorkspace& w, SolverConfig& config) {
    const std::size_t m = config.pack.marker_count;
    for (std::size_t k = 0; k < m; ++k) w.weights[k] = Mat3::Identity();
    w.full_posterior.valid = false;
    follow_confidence(config.pack, config.precise_tables, {w.weights.data(), m}, w.full_posterior,
                      w.confidence);
    read_confidence(config.pack, w.full_posterior, config.full_confidence);
}

// Rest, before anything was seen: zero, as far as the ranges allow.
void rest(const SolvePack& pack, SolverState& state) {
    for (std::size_t i = 0; i < pack.shape_count; ++i) {
        state.previous[i] = std::clamp(0.0, static_cast<double>(pack.weight_low[i]),
                                       static_cast<double>(pack.weight_high[i]));
    }
}

// In one precision: from the markers to output.weights.
template <typename Real>
void solve_in(const SolverConfig& config, const NormalTables<Real>& tables, const InferenceOutput& completed,
              const NormalInput& input, bool enough, SolverState& state, QuadraticState<Real>& quadratic,
              QuadraticWorkspace<Real>& own, SolverWorkspace& w, SolverOutput& output, SolverReport& report) {
    const SolvePack& pack = config.pack;
    const std::size_t n = pack.shape_count;
    build_normal_equations(pack, tables, input, quadratic.normal, quadratic.qp, own.equations);
    report.markers_used = static_cast<std::uint16_t>(own.equations.markers_used);
    report.work = own.equations.work;
    update_confidence(config, quadratic.normal, state, w);
    output.confidence = state.confidence;
    if (!enough) {
        output.weights = state.previous;
        return;
    }
    const bool is_rbf = pack.solver == SolverKind::kRbf;
    const bool measures = is_rbf || is_regional(pack.solver);  // no quadratic in w
    const bool controlled = config.controls.acts_on_problem;   // then Real is double
    if (is_rbf) run_rbf(config, completed, w, report);
    if (is_regional(pack.solver)) run_regional(config, state, w, output, report);
    if (measures ? report.hull_share > 0.0 : !controlled) {
        run_quadratic(config, pack_problem(config, quadratic.normal, own), state, quadratic.qp, own, output,
                      report);
    }
    if (is_rbf) blend_rbf({w.rbf_weights.data(), n}, report.hull_share, output);
    if constexpr (sizeof(Real) == sizeof(double)) {
        if (controlled) {
            run_controlled(config, measures ? nullptr : &quadratic.normal, input.gamma_scale, state, own,
                           output, report);
        }
    }
    for (std::size_t i = 0; i < n; ++i) {
        if (!is_finite(output.weights[i])) output.weights[i] = state.previous[i];
        output.weights[i] = std::clamp(output.weights[i], static_cast<double>(pack.weight_low[i]),
                                       static_cast<double>(pack.weight_high[i]));
        own.weights[i] = static_cast<Real>(output.weights[i]);
    }
    for (std::size_t i = n; i < padded(n); ++i) own.weights[i] = Real(0);
    report.residual_rms_mm =
        residual_rms_mm(pack, tables, input, std::span<const Real>(own.weights.data(), padded(n)));
    report.solved = true;
}

}  // namespace

void configure_solver(const SolvePack& pack, double rate_hz, SolverWorkspace& workspace,
                      SolverConfig& config) {
    config.pack = pack;
    config.rate_hz = rate_hz;
    measure_firmness(pack, config);
    build_regional_tables(pack, config.regional);
    build_normal_tables(pack, config.tables);
    build_normal_tables(pack, config.precise_tables);
    if (pack.solver == SolverKind::kRbf) build_rbf_tables(pack, config.rbf);
    measure_full_confidence(workspace, config);
    prepare_controls(pack, ControlSet{}, config.controls);
}

void reset_solver(SolverState& state) {
    state.quadratic.normal.valid = false;
    state.quadratic.qp.warm = false;
    state.precise.normal.valid = false;
    state.precise.qp.warm = false;
    state.controlled.qp.warm = false;
    reset_regions(state.regional);
    state.has_previous = false;
    state.posterior.valid = false;
    state.confidence = {};
}

void solve(const SolverConfig& config, const StabiliserOutput& stabilised, const InferenceOutput& completed,
           std::int64_t capture_us, SolverState& state, SolverWorkspace& w, SolverOutput& output,
           SolverReport& report) {
    report = SolverReport{};
    const SolvePack& pack = config.pack;
    if (!state.has_previous) rest(pack, state);
    const bool enough = fill_input(config, stabilised, w) >= kMinMarkers;
    NormalInput input;
    input.positions_mm = {w.positions_mm.data(), pack.marker_count};
    input.weights = {w.weights.data(), pack.marker_count};
    input.previous = {state.previous.data(), pack.shape_count};
    input.gamma_scale = gamma_scale(config, state, capture_us);
    const bool firm = config.ridge_share + input.gamma_scale * config.pull_share >= kFirmShare;
    const bool single = firm && !config.controls.acts_on_problem;
    if (single) {
        solve_in(config, config.tables, completed, input, enough, state, state.quadratic, w.quadratic, w,
                 output, report);
    } else {
        solve_in(config, config.precise_tables, completed, input, enough, state, state.precise, w.precise, w,
                 output, report);
    }
    if (!report.solved) return;
    state.previous = output.weights;
    state.previous_us = capture_us;
    state.has_previous = true;
}

}  // namespace rig
