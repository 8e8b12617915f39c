#include "firmware_host/companion/train/gcv.hpp"

#include <algorithm>
#include <cmath>

namespace rig::host {

namespace {

constexpr int kMostIterations = 200;
constexpr double kThreshold = 1e-6;  // of GCV: "less than a specified small threshold" in the source
constexpr double kStart = 1e-3;      // of the largest eigenvalue

}  // namespace

double gcv_at(const Eigen::VectorXd& eigenvalues, const Eigen::VectorXd& targets, double lambda) {
    const Eigen::ArrayXd left = lambda / (eigenvalues.array() + lambda);  // the eigenvalues of P
    const double trace = left.sum();
    return static_cast<double>(eigenvalues.size()) * (left * targets.array()).square().sum() /
           (trace * trace);
}

GcvPath minimise_gcv(const Eigen::VectorXd& eigenvalues, const Eigen::VectorXd& targets, double least) {
    const double most = std::max(least, 1e3 * eigenvalues.maxCoeff());
    GcvPath path;
    double lambda = std::max(least, kStart * eigenvalues.maxCoeff());
    for (int iteration = 0; iteration < kMostIterations; ++iteration) {
        path.push_back({lambda, gcv_at(eigenvalues, targets, lambda)});
        const double gcv = path.back().gcv;
        if (path.size() > 1 && std::abs(path[path.size() - 2].gcv - gcv) <= kThreshold * gcv) break;
        const Eigen::ArrayXd shrunk = 1.0 / (eigenvalues.array() + lambda);
        const double residual = (lambda * shrunk * targets.array()).square().sum();  // y^T P^2 y
        const double trace = (lambda * shrunk).sum();                                // tr P
        const double slope = (eigenvalues.array() * shrunk.square()).sum();          // tr(A^-1 - lambda A^-2)
        const double length =
            (eigenvalues.array() * targets.array().square() * shrunk.cube()).sum();  // w^T A^-1 w
        if (!(length > 0.0) || !(trace > 0.0)) break;
        lambda = std::clamp(residual * slope / (length * trace), least, most);
    }
    return path;
}

}  // namespace rig::host
