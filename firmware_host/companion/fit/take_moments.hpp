// What a solved take says about each marker, as sums: enough to tell the error of any place on the mesh over
// every frame without going through the frames again.
//
//   error(A) = sum_f |x_f - A z_f|^2 = tr(A S A^T) - 2 tr(A X^T) + xx,   z_f = [1; w_f]
//   S = sum z z^T,   X = sum x z^T,   xx = sum |x|^2,   over the frames that saw the marker
//
// A [3 x (N + 1)] is how a point moves (vertex_motion.hpp). A place on a triangle is A = sum_c b_c A_c, so
// its error is a quadratic in the barycentric coordinates b.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "firmware_host/companion/fit/take_solve.hpp"
#include "firmware_host/companion/rig_folder/surface.hpp"

namespace rig::host {

struct MarkerMoments {
    double count = 0.0;  // frames
    Eigen::MatrixXd zz;  // S [(N + 1) x (N + 1)], symmetric
    Eigen::MatrixXd xz;  // X [3 x (N + 1)], mm
    double xx = 0.0;     // mm^2

    // Mean square distance from a point that moves as `motion`, mm^2; 0 where no frame counts.
    [[nodiscard]] double mean_square_mm2(const Eigen::MatrixXd& motion) const;
    // Mean of x - A z, mm.
    [[nodiscard]] Vec3 mean_error_mm(const Eigen::MatrixXd& motion) const;
};

// One for each marker of the take, whose positions are taken to the face frame by the slip of each frame.
[[nodiscard]] std::vector<MarkerMoments> take_moments(const MarkerTake& take, const SolvedTake& solved);

// E(b) = b^T G b - 2 g^T b + constant, b >= 0, sum b = 1: exact, by the interior point and the three edges.
struct TriangleQuadratic {
    Mat3 gram = Mat3::Zero();
    Vec3 linear = Vec3::Zero();
    double constant = 0.0;

    [[nodiscard]] double at(const Vec3& b) const { return b.dot(gram * b) - 2.0 * linear.dot(b) + constant; }
    [[nodiscard]] Vec3 best_place() const;
};

// `corners`: the motion of the triangle's three vertices. E is the mean square distance over the take, mm^2.
[[nodiscard]] TriangleQuadratic triangle_quadratic(const MarkerMoments& moments,
                                                   const std::array<Eigen::MatrixXd, 3>& corners);

}  // namespace rig::host
