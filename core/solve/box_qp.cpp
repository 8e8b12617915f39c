#include "core/solve/box_qp.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"
#include "core/base/dense.hpp"
#include "core/base/math.hpp"

namespace rig {

namespace {

using Where = BoxQpState::Where;

constexpr std::size_t kStride = kMaxShapes;

const double* row(const BoxQpProblem& p, std::size_t i) {
    return p.hessian.data() + i * kStride;
}

void place(const BoxQpProblem& p, BoxQpState& state, std::span<double> w) {
    for (std::size_t i = 0; i < p.size; ++i) {
        if (!state.warm) state.where[i] = Where::kFree;
        if (p.low[i] == p.high[i]) state.where[i] = Where::kLow;
        if (state.where[i] == Where::kLow && !is_finite(p.low[i])) state.where[i] = Where::kFree;
        if (state.where[i] == Where::kHigh && !is_finite(p.high[i])) state.where[i] = Where::kFree;
        if (!is_finite(w[i])) w[i] = 0.0;
        w[i] = std::clamp(w[i], p.low[i], p.high[i]);
        if (state.where[i] == Where::kLow) w[i] = p.low[i];
        if (state.where[i] == Where::kHigh) w[i] = p.high[i];
    }
    state.warm = true;
}

void gradient_at(const BoxQpProblem& p, std::span<const double> w, std::span<double> gradient) {
    for (std::size_t i = 0; i < p.size; ++i) gradient[i] = dot(row(p, i), w.data(), p.size) + p.linear[i];
}

std::size_t collect_free(const BoxQpProblem& p, const BoxQpState& state, BoxQpWorkspace& ws) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < p.size; ++i) {
        if (state.where[i] == Where::kFree) ws.free[count++] = static_cast<std::uint16_t>(i);
    }
    return count;
}

// Newton step on the free variables into ws.step[0, count). False when H is not positive definite there.
bool free_step(const BoxQpProblem& p, std::size_t count, BoxQpWorkspace& ws) {
    for (std::size_t a = 0; a < count; ++a) {
        const double* from = row(p, ws.free[a]);
        for (std::size_t b = 0; b <= a; ++b) ws.factor[a * kStride + b] = from[ws.free[b]];
        ws.step[a] = -ws.gradient[ws.free[a]];
    }
    if (!cholesky(ws.factor.data(), ws.factor.data(), count, kStride)) return false;
    solve_lower(ws.factor.data(), count, kStride, ws.step.data());
    solve_lower_transposed(ws.factor.data(), count, kStride, ws.step.data());
    return true;
}

// Walks along the step as far as the bounds allow. The variable that reaches its bound first is fixed there,
// and the next iteration takes a step with the others; returns true for a full step.
bool walk(const BoxQpProblem& p, std::size_t count, BoxQpState& state, BoxQpWorkspace& ws,
          std::span<double> w) {
    double length = 1.0;
    std::size_t blocking = count;
    for (std::size_t a = 0; a < count; ++a) {
        const std::size_t i = ws.free[a];
        const double d = ws.step[a];
        if (d == 0.0) continue;
        const double room = d > 0.0 ? p.high[i] - w[i] : p.low[i] - w[i];
        if (d > 0.0 ? d * length > room : d * length < room) {
            length = room / d;
            blocking = a;
        }
    }
    length = std::max(length, 0.0);
    for (std::size_t a = 0; a < count; ++a) {
        const std::size_t i = ws.free[a];
        w[i] = std::clamp(w[i] + length * ws.step[a], p.low[i], p.high[i]);
    }
    if (blocking == count) return true;
    const std::size_t i = ws.free[blocking];
    state.where[i] = ws.step[blocking] > 0.0 ? Where::kHigh : Where::kLow;
    w[i] = ws.step[blocking] > 0.0 ? p.high[i] : p.low[i];
    return false;
}

// The bound variable whose multiplier has the wrong sign by most, measured as the move it would make; N when
// none.
std::size_t worst_multiplier(const BoxQpProblem& p, const BoxQpState& state, std::span<const double> gradient,
                             double tolerance) {
    std::size_t worst = p.size;
    double largest = tolerance;
    for (std::size_t i = 0; i < p.size; ++i) {
        if (state.where[i] == Where::kFree || p.low[i] == p.high[i]) continue;
        const double wanted = state.where[i] == Where::kLow ? -gradient[i] : gradient[i];
        const double move = wanted / row(p, i)[i];
        if (move > largest) {
            largest = move;
            worst = i;
        }
    }
    return worst;
}

double projected_jacobi_move(const BoxQpProblem& p, std::span<const double> w,
                             std::span<const double> gradient) {
    double largest = 0.0;
    for (std::size_t i = 0; i < p.size; ++i) {
        const double target = std::clamp(w[i] - gradient[i] / row(p, i)[i], p.low[i], p.high[i]);
        largest = std::max(largest, std::fabs(w[i] - target));
    }
    return largest;
}

}  // namespace

BoxQpReport solve_box_qp(const BoxQpProblem& problem, const BoxQpConfig& config, BoxQpState& state,
                         BoxQpWorkspace& workspace, std::span<double> w) {
    const std::size_t n = problem.size;
    RIG_CHECK(n <= kMaxShapes && w.size() >= n && problem.hessian.size() >= n * kStride);
    RIG_CHECK(problem.linear.size() >= n && problem.low.size() >= n && problem.high.size() >= n);
    BoxQpReport report;
    place(problem, state, w);
    const std::span<double> gradient(workspace.gradient.data(), n);
    while (report.iterations < config.iteration_cap) {
        ++report.iterations;
        gradient_at(problem, w, gradient);
        const std::size_t count = collect_free(problem, state, workspace);
        if (!free_step(problem, count, workspace)) break;
        if (!walk(problem, count, state, workspace, w)) continue;
        gradient_at(problem, w, gradient);
        const std::size_t released = worst_multiplier(problem, state, gradient, config.kkt_tolerance);
        if (released == n) {
            report.optimal = true;
            break;
        }
        state.where[released] = Where::kFree;
    }
    gradient_at(problem, w, gradient);
    report.kkt = projected_jacobi_move(problem, w, gradient);
    report.objective = 0.5 * (dot(gradient.data(), w.data(), n) + dot(problem.linear.data(), w.data(), n));
    return report;
}

}  // namespace rig
