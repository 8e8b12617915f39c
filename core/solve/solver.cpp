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
void update_confidence(const SolverConfig& config, const NormalState<Real>& normal, bool changed,
                       SolverState& state, SolverWorkspace& w) {
    if (state.has_confidence && !changed) return;
    const SolvePack& pack = config.pack;
    const std::size_t n = pack.shape_count;
    const std::size_t stride = row_stride(n);
    for (std::size_t i = 0; i < n; ++i) {
        const Real* row = normal.hessian.data() + i * stride;
        for (std::size_t j = 0; j < i; ++j) w.gram[i * kMaxShapes + j] = static_cast<double>(row[j]);
        w.gram_diagonal[i] = std::max(0.0, static_cast<double>(row[i] - normal.regularisation[i]));
    }
    weight_confidence({w.gram, w.gram_diagonal, pack.prior_sigma, static_cast<double>(pack.noise_mm)},
                      w.confidence, state.confidence);
    state.has_confidence = true;
}

template <typename Real>
void run_quadratic(const SolverConfig& config, SolverState& state, QuadraticState<Real>& quadratic,
                   QuadraticWorkspace<Real>& w, SolverOutput& output, SolverReport& report) {
    const std::size_t n = config.pack.shape_count;
    fill_bounds(config.pack, w);
    const std::size_t stride = row_stride(n);
    const BoxQpProblem<Real> problem{n,
                                     stride,
                                     {quadratic.normal.hessian.data(), n * stride},
                                     w.equations.linear,
                                     w.low,
                                     w.high,
                                     quadratic.normal.version};
    for (std::size_t i = 0; i < n; ++i) w.weights[i] = static_cast<Real>(state.previous[i]);
    const BoxQpReport qp =
        solve_box_qp(problem, sizeof(Real) == sizeof(float) ? config.qp : config.precise_qp, quadratic.qp,
                     w.qp, std::span<Real>(w.weights.data(), n));
    for (std::size_t i = 0; i < n; ++i) output.weights[i] = static_cast<double>(w.weights[i]);
    report.optimal = qp.optimal;
    report.kkt = qp.kkt;
    report.iterations = qp.iterations;
    report.changes = qp.changes;
    report.work += qp.work;
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

template <typename Real>
void configure_tables(const SolvePack& pack, NormalTables<Real>& tables, SolverWorkspace& w) {
    build_normal_tables(pack, tables);
    const std::size_t stride = row_stride(pack.shape_count);
    for (std::size_t i = 0; i < pack.shape_count; ++i) {
        const Real* row = tables.full_gram.data() + i * stride;
        for (std::size_t j = 0; j < i; ++j) w.gram[i * kMaxShapes + j] = static_cast<double>(row[j]);
        w.gram_diagonal[i] = static_cast<double>(row[i]);
    }
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
    update_confidence(config, quadratic.normal, own.equations.changed, state, w);
    output.confidence = state.confidence;
    if (!enough) {
        output.weights = state.previous;
        return;
    }
    if (pack.solver == SolverKind::kRbf) {
        run_rbf(config, completed, w, output, report);
    } else {
        run_quadratic(config, state, quadratic, own, output, report);
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
    configure_tables(pack, config.tables, workspace);
    configure_tables(pack, config.precise_tables, workspace);
    weight_confidence(
        {workspace.gram, workspace.gram_diagonal, pack.prior_sigma, static_cast<double>(pack.noise_mm)},
        workspace.confidence, config.full_confidence);
}

void reset_solver(SolverState& state) {
    state.quadratic.normal.valid = false;
    state.quadratic.qp.warm = false;
    state.precise.normal.valid = false;
    state.precise.qp.warm = false;
    state.has_previous = false;
    state.has_confidence = false;
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
    const bool single = config.ridge_share + input.gamma_scale * config.pull_share >= kFirmShare;
    if (single != state.in_single) state.has_confidence = false;
    state.in_single = single;
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
