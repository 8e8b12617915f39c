#include "core/solve/nnls.hpp"

#include <algorithm>
#include <limits>

#include "core/base/check.hpp"
#include "core/base/math.hpp"

namespace rig {

namespace {

constexpr double kLeastTilt = 1e-30;  // a problem without any data has one answer too: zero

void copy_problem(const NnlsProblem& p, NnlsWorkspace& ws) {
    double largest = 0.0;
    for (std::size_t i = 0; i < p.count; ++i) largest = std::max(largest, p.hessian[i * p.stride + i]);
    for (std::size_t i = 0; i < p.count; ++i) {
        for (std::size_t j = 0; j < p.count; ++j) {
            ws.hessian[i * kMaxShapes + j] = p.hessian[i * p.stride + j];
        }
        ws.hessian[i * kMaxShapes + i] += kNnlsTilt * largest + kLeastTilt;
        ws.linear[i] = -p.linear[i];
        ws.low[i] = 0.0;
        ws.high[i] = std::numeric_limits<double>::infinity();
    }
}

}  // namespace

BoxQpReport solve_nnls(const NnlsProblem& problem, NnlsState& state, NnlsWorkspace& workspace,
                       BoxQpWorkspace& box_workspace, std::span<double> w) {
    RIG_CHECK(problem.count > 0 && problem.count <= kMaxRegionShapes && problem.stride >= problem.count);
    RIG_CHECK(problem.hessian.size() >= (problem.count - 1) * problem.stride + problem.count);
    RIG_CHECK(problem.linear.size() >= problem.count && w.size() >= problem.count);
    copy_problem(problem, workspace);
    if (state.count != problem.count) {
        state = NnlsState{};
        state.count = static_cast<std::uint16_t>(problem.count);
    }
    if (!state.box.warm) {
        // Every key shape is used by few frames, so a cold solve starts from none of them.
        state.box.where.fill(BoxQpState::Where::kLow);
        state.box.warm = true;
    }
    const BoxQpProblem box{problem.count, workspace.hessian, workspace.linear, workspace.low, workspace.high};
    const std::span<double> answer(state.weights.data(), problem.count);
    const BoxQpReport report = solve_box_qp(box, {}, state.box, box_workspace, answer);
    for (std::size_t i = 0; i < problem.count; ++i) {
        if (!is_finite(answer[i])) {
            answer[i] = 0.0;
            state.box.warm = false;
        }
        w[i] = answer[i];
    }
    return report;
}

}  // namespace rig
