#include "firmware_host/companion/fit/take_moments.hpp"

#include <algorithm>
#include <limits>

namespace rig::host {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// tr(A M^T)
double product(const MatrixXd& a, const MatrixXd& m) {
    return a.cwiseProduct(m).sum();
}

}  // namespace

double MarkerMoments::mean_square_mm2(const MatrixXd& motion) const {
    if (count <= 0.0) return 0.0;
    return std::max(0.0, product(motion * zz, motion) - 2.0 * product(motion, xz) + xx) / count;
}

Vec3 MarkerMoments::mean_error_mm(const MatrixXd& motion) const {
    if (count <= 0.0) return Vec3::Zero();
    return (xz.col(0) - motion * zz.col(0)) / count;
}

std::vector<MarkerMoments> take_moments(const MarkerTake& take, const SolvedTake& solved) {
    const Index n = solved.weights.cols() + 1;
    MatrixXd z(solved.weights.rows(), n);
    z.col(0).setOnes();
    z.rightCols(n - 1) = solved.weights;
    for (Index f = 0; f < z.rows(); ++f) {
        if (!solved.solved[static_cast<std::size_t>(f)]) z.row(f).setZero();
    }
    const MatrixXd all = z.transpose() * z;
    std::vector<MarkerMoments> out(take.marker_count);
    MatrixXd x(z.rows(), 3);
    for (std::size_t k = 0; k < take.marker_count; ++k) {
        std::vector<Index> hidden;
        x.setZero();
        MarkerMoments& moments = out[k];
        for (std::size_t f = 0; f < take.frame_count; ++f) {
            const auto row = static_cast<Index>(f);
            if (!solved.solved[f]) continue;
            if (!take.seen(f, k)) {
                hidden.push_back(row);
                continue;
            }
            x.row(row) = solved.headset_from_face[f].apply_inverse(take.at(f, k)).transpose();
            moments.count += 1.0;
        }
        moments.xx = x.squaredNorm();
        moments.xz = x.transpose() * z;
        moments.zz = all;
        for (const Index row : hidden) moments.zz -= z.row(row).transpose() * z.row(row);
    }
    return out;
}

Vec3 TriangleQuadratic::best_place() const {
    // b = e0 + s (e1 - e0) + t (e2 - e0)
    const Vec3 u(-1.0, 1.0, 0.0);
    const Vec3 v(-1.0, 0.0, 1.0);
    const Vec3 e0(1.0, 0.0, 0.0);
    const Vec3 slope = linear - gram * e0;
    const double uu = u.dot(gram * u);
    const double uv = u.dot(gram * v);
    const double vv = v.dot(gram * v);
    const double determinant = uu * vv - uv * uv;
    if (determinant > 1e-12 * uu * vv) {
        const double s = (slope.dot(u) * vv - slope.dot(v) * uv) / determinant;
        const double t = (slope.dot(v) * uu - slope.dot(u) * uv) / determinant;
        if (s >= 0.0 && t >= 0.0 && s + t <= 1.0) return {1.0 - s - t, s, t};
    }
    Vec3 best = e0;
    double least = std::numeric_limits<double>::infinity();
    for (Index i = 0; i < 3; ++i) {
        Vec3 from = Vec3::Zero();
        Vec3 along = Vec3::Zero();
        from[i] = 1.0;
        along[i] = -1.0;
        along[(i + 1) % 3] = 1.0;
        const double curvature = along.dot(gram * along);
        const double wanted = curvature > 0.0 ? along.dot(linear - gram * from) / curvature : 0.0;
        const Vec3 b = from + std::clamp(wanted, 0.0, 1.0) * along;
        if (at(b) < least) {
            least = at(b);
            best = b;
        }
    }
    return best;
}

TriangleQuadratic triangle_quadratic(const MarkerMoments& moments, const std::array<MatrixXd, 3>& corners) {
    TriangleQuadratic out;
    if (moments.count <= 0.0) return out;
    for (std::size_t c = 0; c < 3; ++c) {
        const MatrixXd spread = corners[c] * moments.zz;
        for (std::size_t d = 0; d < 3; ++d) {
            out.gram(static_cast<Index>(c), static_cast<Index>(d)) =
                product(spread, corners[d]) / moments.count;
        }
        out.linear[static_cast<Index>(c)] = product(corners[c], moments.xz) / moments.count;
    }
    out.constant = moments.xx / moments.count;
    return out;
}

}  // namespace rig::host
