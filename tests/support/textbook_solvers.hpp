// Constrained least squares as textbooks have it, in float, over a Gram matrix: what anybody would write
// first. For comparison in benchmarks, and as second opinions in tests; not for use.
#pragma once

#include <Eigen/Core>

namespace rig::test {

struct TextbookProblem {
    Eigen::MatrixXf hessian;  // H [N x N], positive definite
    Eigen::VectorXf low;      // [N]
    Eigen::VectorXf high;     // [N]
};

// Lawson and Hanson (1974, chapter 23), on the normal equations as Bro and de Jong (1997): minimise
// 1/2 w^T H w + q^T w, w >= 0. A Cholesky factor of the passive set in every iteration; starts from w's own
// passive set, which is their warm start. Returns the iterations.
int lawson_hanson(const TextbookProblem& problem, const Eigen::VectorXf& q, Eigen::VectorXf& w);

// Bounded-variable least squares (Stark and Parker 1995): the same with two bounds.
int bounded_least_squares(const TextbookProblem& problem, const Eigen::VectorXf& q, Eigen::VectorXf& w);

// ADMM with the inverse of H + rho I made once (Boyd et al. 2011, section 5.2), until primal and dual
// residual are under `tolerance` or `cap` iterations are done.
class CachedInverseAdmm {
  public:
    CachedInverseAdmm(const TextbookProblem& problem, float rho);
    int solve(const Eigen::VectorXf& q, float tolerance, int cap, Eigen::VectorXf& w);
    void forget();

  private:
    const TextbookProblem& problem_;
    float rho_;
    Eigen::MatrixXf inverse_;
    Eigen::VectorXf z_, u_, x_, right_;
};

}  // namespace rig::test
