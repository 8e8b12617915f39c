#include "core/solve/nnls.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/check.hpp"
#include "core/base/math.hpp"

namespace rig {

namespace {

constexpr double kLeastTilt = 1e-30;      // a problem without any data has one answer too: zero
constexpr double kLeastDiagonal = 1e-20;  // moves nothing
constexpr int kMostRounds = 8;

constexpr BoxQpConfig kPrecise{.tolerance = kNnlsTolerance};

// H + tilt I; returns the tilt.
double copy_hessian(const NnlsProblem& p, NnlsWorkspace& ws) {
    const std::size_t stride = row_stride(p.count);
    double tilt = 0.0;
    for (std::size_t i = 0; i < p.count; ++i) tilt = std::max(tilt, p.hessian[i * p.stride + i]);
    tilt = kNnlsTilt * tilt + kLeastTilt;
    for (std::size_t i = 0; i < p.count; ++i) {
        for (std::size_t j = 0; j < stride; ++j) {
            ws.hessian[i * stride + j] = j < p.count ? p.hessian[i * p.stride + j] : 0.0;
        }
        ws.hessian[i * stride + i] += tilt;
        ws.low[i] = 0.0;
        ws.high[i] = std::numeric_limits<double>::infinity();
    }
    return tilt;
}

// Of the problem itself, without the tilt.
void certify(const NnlsProblem& p, std::span<const double> w, BoxQpReport& report) {
    double scale = 0.01;
    report.kkt = 0.0;
    report.objective = 0.0;
    for (std::size_t i = 0; i < p.count; ++i) {
        double product = 0.0;
        for (std::size_t j = 0; j < p.count; ++j) product += p.hessian[i * p.stride + j] * w[j];
        const double diagonal = p.hessian[i * p.stride + i];
        if (diagonal > kLeastDiagonal) {
            const double target = std::max(0.0, w[i] - (product - p.linear[i]) / diagonal);
            report.kkt = std::max(report.kkt, std::fabs(w[i] - target));
        }
        report.objective += w[i] * (0.5 * product - p.linear[i]);
        scale = std::max(scale, w[i]);
    }
    report.optimal = report.kkt <= 10.0 * kNnlsTolerance * scale;
}

}  // namespace

BoxQpReport solve_nnls(const NnlsProblem& problem, NnlsState& state, NnlsWorkspace& workspace,
                       std::span<double> w) {
    RIG_CHECK(problem.count > 0 && problem.count <= kMaxRegionShapes && problem.stride >= problem.count);
    RIG_CHECK(problem.hessian.size() >= (problem.count - 1) * problem.stride + problem.count);
    RIG_CHECK(problem.linear.size() >= problem.count && w.size() >= problem.count);
    if (state.count != problem.count) {
        state = NnlsState{};  // every key shape is used by few frames: from none of them
        state.count = static_cast<std::uint16_t>(problem.count);
    }
    const double tilt = copy_hessian(problem, workspace);
    const std::span<double> answer(state.weights.data(), problem.count);
    const BoxQpProblem<double> box{problem.count,     row_stride(problem.count),
                                   workspace.hessian, workspace.linear,
                                   workspace.low,     workspace.high};
    workspace.box.warm = false;  // another region's
    workspace.centre.fill(0.0);
    BoxQpReport report;
    for (int round = 0; round < kMostRounds && !report.optimal; ++round) {
        for (std::size_t i = 0; i < problem.count; ++i) {
            workspace.linear[i] = -problem.linear[i] - tilt * workspace.centre[i];
        }
        const BoxQpReport one = solve_box_qp(box, kPrecise, workspace.box, workspace.box_workspace, answer);
        for (std::size_t i = 0; i < problem.count; ++i) {
            if (!is_finite(answer[i])) answer[i] = 0.0;
            workspace.centre[i] = answer[i];
        }
        report.iterations = static_cast<std::uint16_t>(report.iterations + one.iterations);
        report.changes = static_cast<std::uint16_t>(report.changes + one.changes);
        report.rebuilds = static_cast<std::uint16_t>(report.rebuilds + one.rebuilds);
        certify(problem, answer, report);
    }
    std::copy(answer.begin(), answer.end(), w.begin());
    return report;
}

}  // namespace rig
