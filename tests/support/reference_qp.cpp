#include "tests/support/reference_qp.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tests/support/dense_solve.hpp"

namespace rig::test {

namespace {

// The minimum with the variables of `pattern` (base 3: free, low, high) fixed; false when it is not feasible.
bool minimum_of_pattern(const ReferenceQp& p, std::size_t pattern, std::vector<long double>& w) {
    std::vector<std::size_t> free;
    for (std::size_t i = 0; i < p.size; ++i, pattern /= 3) {
        if (pattern % 3 == 0) {
            free.push_back(i);
            continue;
        }
        w[i] = pattern % 3 == 1 ? p.low[i] : p.high[i];
        if (!std::isfinite(w[i])) return false;
    }
    std::vector<long double> a;
    std::vector<long double> b;
    for (const std::size_t i : free) {
        long double right = -p.linear[i];
        for (std::size_t j = 0; j < p.size; ++j) {
            const bool is_free = std::find(free.begin(), free.end(), j) != free.end();
            if (is_free) {
                a.push_back(p.hessian[i * p.size + j]);
            } else {
                right -= p.hessian[i * p.size + j] * w[j];
            }
        }
        b.push_back(right);
    }
    if (!solve_dense(std::move(a), b, 0.0L)) return false;  // a part of a positive definite matrix: it does
    for (std::size_t k = 0; k < free.size(); ++k) {
        w[free[k]] = b[k];
        if (!(b[k] >= p.low[free[k]] && b[k] <= p.high[free[k]])) return false;
    }
    return true;
}

}  // namespace

long double ReferenceQp::objective(const std::vector<long double>& w) const {
    long double sum = 0.0L;
    for (std::size_t i = 0; i < size; ++i) {
        long double row = 0.0L;
        for (std::size_t j = 0; j < size; ++j) row += hessian[i * size + j] * w[j];
        sum += 0.5L * w[i] * row + linear[i] * w[i];
    }
    return sum;
}

std::vector<long double> ReferenceQp::gradient(const std::vector<long double>& w) const {
    std::vector<long double> g = linear;
    for (std::size_t i = 0; i < size; ++i) {
        for (std::size_t j = 0; j < size; ++j) g[i] += hessian[i * size + j] * w[j];
    }
    return g;
}

std::vector<long double> solve_exhaustively(const ReferenceQp& problem) {
    std::size_t patterns = 1;
    for (std::size_t i = 0; i < problem.size; ++i) patterns *= 3;
    std::vector<long double> best(problem.size, 0.0L);
    long double least = std::numeric_limits<long double>::infinity();
    std::vector<long double> w(problem.size, 0.0L);
    for (std::size_t pattern = 0; pattern < patterns; ++pattern) {
        if (!minimum_of_pattern(problem, pattern, w)) continue;
        const long double value = problem.objective(w);
        if (value < least) {
            least = value;
            best = w;
        }
    }
    return best;
}

std::vector<long double> solve_by_descent(const ReferenceQp& p, long double tolerance, int sweeps) {
    std::vector<long double> w(p.size);
    for (std::size_t i = 0; i < p.size; ++i) w[i] = std::clamp(0.0L, p.low[i], p.high[i]);
    std::vector<long double> g = p.gradient(w);
    for (int sweep = 0; sweep < sweeps; ++sweep) {
        long double largest = 0.0L;
        for (std::size_t i = 0; i < p.size; ++i) {
            const long double target =
                std::clamp(w[i] - g[i] / p.hessian[i * p.size + i], p.low[i], p.high[i]);
            const long double move = target - w[i];
            if (move == 0.0L) continue;
            for (std::size_t j = 0; j < p.size; ++j) g[j] += p.hessian[j * p.size + i] * move;
            w[i] = target;
            largest = std::max(largest, std::fabs(move));
        }
        if (largest < tolerance) break;
    }
    return w;
}

}  // namespace rig::test
