// The ridge parameter of a linear regression by generalised cross-validation [Deng06 section 6].
//
//   GCV(lambda) = K |P y|^2 / tr(P)^2,   P = I - H (H^T H + lambda I)^-1 H^T = lambda (H H^T + lambda I)^-1
//
// Setting d GCV / d lambda = 0 gives the fixed point lambda = y^T P^2 y tr(A^-1 - lambda A^-2) / (w^T A^-1 w
// tr P), A = H^T H + lambda I (Orr 1996, eq. 22), which is iterated until GCV stands still, as the source
// does.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace rig::host {

struct GcvStep {
    double lambda = 0.0;
    double gcv = 0.0;
};

// One step an iteration; the last one is the answer.
using GcvPath = std::vector<GcvStep>;

// GCV at lambda > 0 of K samples, in the eigenbasis of H H^T: `eigenvalues` [K] >= 0, `targets` = U^T y [K].
[[nodiscard]] double gcv_at(const Eigen::VectorXd& eigenvalues, const Eigen::VectorXd& targets,
                            double lambda);

// Iterated until GCV changes by less than a millionth of itself, 200 times at most. lambda stays within
// [least, 1000 times the largest eigenvalue]; least > 0. At least one step.
[[nodiscard]] GcvPath minimise_gcv(const Eigen::VectorXd& eigenvalues, const Eigen::VectorXd& targets,
                                   double least);

}  // namespace rig::host
