#include "tests/support/textbook_solvers.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

namespace rig::test {

namespace {

constexpr float kTolerance = 1e-6F;

struct Passive {
    std::vector<Eigen::Index> index;
    Eigen::MatrixXf hessian;
    Eigen::VectorXf right;
};

// The minimum over the passive variables with the others where they are.
Eigen::VectorXf passive_minimum(const TextbookProblem& p, const Eigen::VectorXf& q, const Eigen::VectorXf& w,
                                const std::vector<char>& passive, Passive& work) {
    work.index.clear();
    for (Eigen::Index i = 0; i < w.size(); ++i) {
        if (passive[static_cast<std::size_t>(i)] != 0) work.index.push_back(i);
    }
    const auto k = static_cast<Eigen::Index>(work.index.size());
    Eigen::VectorXf fixed = w;
    for (const Eigen::Index i : work.index) fixed[i] = 0.0F;
    const Eigen::VectorXf pull = q + p.hessian * fixed;
    work.hessian.resize(k, k);
    work.right.resize(k);
    for (Eigen::Index a = 0; a < k; ++a) {
        work.right[a] = -pull[work.index[static_cast<std::size_t>(a)]];
        for (Eigen::Index b = 0; b < k; ++b) {
            work.hessian(a, b) =
                p.hessian(work.index[static_cast<std::size_t>(a)], work.index[static_cast<std::size_t>(b)]);
        }
    }
    return work.hessian.llt().solve(work.right);
}

// Moves the passive variables towards `aim` until one meets a bound; false for the whole way.
bool step_to(const TextbookProblem& p, const Passive& work, const Eigen::VectorXf& aim,
             std::vector<char>& passive, Eigen::VectorXf& w) {
    float length = 1.0F;
    Eigen::Index blocking = -1;
    for (Eigen::Index a = 0; a < aim.size(); ++a) {
        const Eigen::Index i = work.index[static_cast<std::size_t>(a)];
        if (aim[a] >= p.low[i] && aim[a] <= p.high[i]) continue;
        const float room = ((aim[a] < p.low[i] ? p.low[i] : p.high[i]) - w[i]) / (aim[a] - w[i]);
        if (room < length) {
            length = std::max(room, 0.0F);
            blocking = i;
        }
    }
    for (Eigen::Index a = 0; a < aim.size(); ++a) {
        const Eigen::Index i = work.index[static_cast<std::size_t>(a)];
        w[i] = std::clamp(w[i] + length * (aim[a] - w[i]), p.low[i], p.high[i]);
    }
    if (blocking >= 0) passive[static_cast<std::size_t>(blocking)] = 0;
    return blocking >= 0;
}

}  // namespace

int bounded_least_squares(const TextbookProblem& p, const Eigen::VectorXf& q, Eigen::VectorXf& w) {
    const Eigen::Index n = w.size();
    std::vector<char> passive(static_cast<std::size_t>(n));
    for (Eigen::Index i = 0; i < n; ++i) {
        w[i] = std::clamp(w[i], p.low[i], p.high[i]);
        passive[static_cast<std::size_t>(i)] = w[i] > p.low[i] && w[i] < p.high[i] ? 1 : 0;
    }
    Passive work;
    int iterations = 0;
    const int cap = 10 * static_cast<int>(n);
    while (iterations < cap) {
        do {
            ++iterations;
            const Eigen::VectorXf aim = passive_minimum(p, q, w, passive, work);
            if (!aim.allFinite() || !step_to(p, work, aim, passive, w)) break;
        } while (iterations < cap);
        const Eigen::VectorXf gradient = p.hessian * w + q;
        Eigen::Index best = -1;
        float most = kTolerance;
        for (Eigen::Index i = 0; i < n; ++i) {
            if (passive[static_cast<std::size_t>(i)] != 0) continue;
            const float move = (w[i] <= p.low[i] ? -gradient[i] : gradient[i]) / p.hessian(i, i);
            if (move > most) {
                most = move;
                best = i;
            }
        }
        if (best < 0) break;
        passive[static_cast<std::size_t>(best)] = 1;
    }
    return iterations;
}

int lawson_hanson(const TextbookProblem& p, const Eigen::VectorXf& q, Eigen::VectorXf& w) {
    return bounded_least_squares(p, q, w);  // its special case high = infinity
}

CachedInverseAdmm::CachedInverseAdmm(const TextbookProblem& problem, float rho)
    : problem_(problem), rho_(rho) {
    const Eigen::Index n = problem.hessian.rows();
    const Eigen::MatrixXf shifted = problem.hessian + rho * Eigen::MatrixXf::Identity(n, n);
    inverse_ = shifted.cast<double>().inverse().cast<float>();
    forget();
}

void CachedInverseAdmm::forget() {
    z_ = u_ = x_ = Eigen::VectorXf::Zero(problem_.hessian.rows());
}

int CachedInverseAdmm::solve(const Eigen::VectorXf& q, float tolerance, int cap, Eigen::VectorXf& w) {
    int iterations = 0;
    while (iterations < cap) {
        ++iterations;
        right_ = rho_ * (z_ - u_) - q;
        x_.noalias() = inverse_ * right_;
        const Eigen::VectorXf z = (x_ + u_).cwiseMax(problem_.low).cwiseMin(problem_.high);
        const float dual = rho_ * (z - z_).cwiseAbs().maxCoeff();
        z_ = z;
        u_ += x_ - z_;
        if (dual < tolerance && (x_ - z_).cwiseAbs().maxCoeff() < tolerance) break;
    }
    w = z_;
    return iterations;
}

}  // namespace rig::test
