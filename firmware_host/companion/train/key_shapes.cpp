#include "firmware_host/companion/train/key_shapes.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "core/limits.hpp"
#include "core/solve/nnls.hpp"
#include "firmware_host/companion/train/reference_frames.hpp"

namespace rig::host {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// [F x d] projections on the first d principal axes of the frames.
MatrixXd principal_components(const MatrixXd& positions, Index d) {
    const MatrixXd centred = positions.rowwise() - positions.colwise().mean();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(centred.transpose() * centred);
    // Eigenvalues rise; the sign of an axis is fixed so that its largest entry is positive.
    MatrixXd axes = solver.eigenvectors().rightCols(d).rowwise().reverse();
    for (Index a = 0; a < d; ++a) {
        Index largest = 0;
        axes.col(a).cwiseAbs().maxCoeff(&largest);
        if (axes(largest, a) < 0.0) axes.col(a) *= -1.0;
    }
    return centred * axes;
}

KeyShapes from_frames(const RegionMotion& motion, std::vector<Index> frames) {
    KeyShapes out;
    out.positions_mm.resize(static_cast<Index>(frames.size()), motion.positions_mm.cols());
    out.weights.resize(static_cast<Index>(frames.size()), motion.weights.cols());
    for (std::size_t k = 0; k < frames.size(); ++k) {
        out.positions_mm.row(static_cast<Index>(k)) = motion.positions_mm.row(frames[k]);
        out.weights.row(static_cast<Index>(k)) = motion.weights.row(frames[k]);
    }
    out.frames = std::move(frames);
    return out;
}

// Adds the frame that is farthest out along `along` of those not chosen yet.
void add_extreme(const VectorXd& along, std::vector<bool>& taken, std::vector<Index>& chosen) {
    Index best = -1;
    for (Index f = 0; f < along.size(); ++f) {
        if (!taken[static_cast<std::size_t>(f)] && (best < 0 || along[f] > along[best])) best = f;
    }
    if (best < 0) return;
    taken[static_cast<std::size_t>(best)] = true;
    chosen.push_back(best);
}

std::vector<Index> widest(const MatrixXd& components, std::size_t count) {
    std::vector<Index> chosen;
    std::vector<bool> taken(static_cast<std::size_t>(components.rows()), false);
    for (Index axis = 0; axis < components.cols() && chosen.size() < count; ++axis) {
        add_extreme(components.col(axis), taken, chosen);
        if (chosen.size() < count) add_extreme(-components.col(axis), taken, chosen);
    }
    return chosen;
}

KeyShapes cluster_means(const RegionMotion& motion, const MatrixXd& components, std::size_t count) {
    // From frames at even times: the source names no start, and one of maximum spread would be the other
    // method.
    std::vector<Index> starts;
    const auto frames = static_cast<std::size_t>(components.rows());
    for (std::size_t c = 0; c < std::min(count, frames); ++c)
        starts.push_back(static_cast<Index>((2 * c + 1) * frames / (2 * std::min(count, frames))));
    const FrameClusters clusters = cluster_frames(components, starts);
    const Index k = clusters.centres.rows();
    KeyShapes out;
    out.positions_mm = MatrixXd::Zero(k, motion.positions_mm.cols());
    out.weights = MatrixXd::Zero(k, motion.weights.cols());
    VectorXd members = VectorXd::Zero(k);
    for (Index f = 0; f < components.rows(); ++f) {
        const Index owner = clusters.owner[static_cast<std::size_t>(f)];
        out.positions_mm.row(owner) += motion.positions_mm.row(f);
        out.weights.row(owner) += motion.weights.row(f);
        members[owner] += 1.0;
    }
    Index kept = 0;
    for (Index c = 0; c < k; ++c) {
        if (members[c] == 0.0) continue;
        const double scale = 1.0 / members[c];
        out.positions_mm.row(kept) = out.positions_mm.row(c).eval() * scale;
        out.weights.row(kept) = out.weights.row(c).eval() * scale;
        ++kept;
        Index nearest = 0;
        (components.rowwise() - clusters.centres.row(c)).rowwise().squaredNorm().minCoeff(&nearest);
        out.frames.push_back(nearest);
    }
    out.positions_mm.conservativeResize(kept, Eigen::NoChange);
    out.weights.conservativeResize(kept, Eigen::NoChange);
    return out;
}

double cross(const MatrixXd& p, Index o, Index a, Index b) {
    return (p(a, 0) - p(o, 0)) * (p(b, 1) - p(o, 1)) - (p(a, 1) - p(o, 1)) * (p(b, 0) - p(o, 0));
}

// Andrew's monotone chain, counter-clockwise.
std::vector<Index> convex_hull(const MatrixXd& points) {
    std::vector<Index> order(static_cast<std::size_t>(points.rows()));
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<Index>(i);
    std::ranges::sort(order, [&](Index a, Index b) {
        if (points(a, 0) != points(b, 0)) return points(a, 0) < points(b, 0);
        return points(a, 1) != points(b, 1) ? points(a, 1) < points(b, 1) : a < b;
    });
    std::vector<Index> hull;
    for (int side = 0; side < 2; ++side) {
        const std::size_t start = hull.size();
        for (const Index i : order) {
            while (hull.size() >= start + 2 && cross(points, hull[hull.size() - 2], hull.back(), i) <= 0.0)
                hull.pop_back();
            hull.push_back(i);
        }
        hull.pop_back();  // the other side begins with it
        std::ranges::reverse(order);
    }
    if (hull.empty() && !order.empty()) hull.push_back(order.front());
    return hull;
}

// Leaves out the corner whose triangle with its neighbours is smallest until `count` are left.
void thin_hull(const MatrixXd& points, std::size_t count, std::vector<Index>& hull) {
    while (hull.size() > count) {
        std::size_t least = 0;
        double least_area = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < hull.size(); ++i) {
            const Index before = hull[(i + hull.size() - 1) % hull.size()];
            const Index after = hull[(i + 1) % hull.size()];
            const double area = std::fabs(cross(points, before, hull[i], after));
            if (area < least_area) {
                least_area = area;
                least = i;
            }
        }
        hull.erase(hull.begin() + static_cast<std::ptrdiff_t>(least));
    }
}

}  // namespace

std::optional<KeyShapeMethod> key_shape_method(std::string_view name) {
    if (name == "spread") return KeyShapeMethod::kSpread;
    if (name == "clusters2") return KeyShapeMethod::kClusters2;
    if (name == "clusters3" || name == "clusters") return KeyShapeMethod::kClusters3;
    if (name == "hull") return KeyShapeMethod::kHull;
    return std::nullopt;
}

std::string_view key_shape_method_name(KeyShapeMethod method) {
    constexpr std::array<std::string_view, 4> kNames{"spread", "clusters2", "clusters3", "hull"};
    return kNames[static_cast<std::size_t>(method)];
}

RegionMotion region_motion(const MarkerRegion& region, std::span<const float> neutral_mm,
                           std::span<const float> basis_mm, std::span<const Take> takes,
                           std::span<const std::size_t> axes) {
    const std::size_t n = basis_mm.size() / neutral_mm.size();
    std::size_t frames = 0;
    for (const Take& take : takes) frames += take.frame_count;
    const auto rows = static_cast<Index>(region.markers.size() * axes.size());
    MatrixXd basis(rows, static_cast<Index>(n));
    VectorXd neutral(rows);
    Index row = 0;
    for (const std::uint16_t k : region.markers) {
        for (const std::size_t axis : axes) {
            double centroid = 0.0;
            for (const std::uint16_t other : region.markers)
                centroid += static_cast<double>(neutral_mm[3U * other + axis]);
            neutral[row] = static_cast<double>(neutral_mm[3U * k + axis]) -
                           centroid / static_cast<double>(region.markers.size());
            for (std::size_t i = 0; i < n; ++i)
                basis(row, static_cast<Index>(i)) = static_cast<double>(basis_mm[(3U * k + axis) * n + i]);
            ++row;
        }
    }
    RegionMotion motion;
    motion.weights.resize(static_cast<Index>(frames), static_cast<Index>(n));
    Index frame = 0;
    for (const Take& take : takes) {
        for (std::size_t f = 0; f < take.frame_count; ++f, ++frame) {
            for (std::size_t i = 0; i < n; ++i)
                motion.weights(frame, static_cast<Index>(i)) = static_cast<double>(take.weights[f * n + i]);
        }
    }
    motion.positions_mm = (motion.weights * basis.transpose()).rowwise() + neutral.transpose();
    return motion;
}

KeyShapes choose_key_shapes(const RegionMotion& motion, KeyShapeMethod method, std::size_t count) {
    const Index rows = motion.positions_mm.cols();
    switch (method) {
        case KeyShapeMethod::kSpread: {
            const auto axes = std::min(rows, static_cast<Index>((count + 1) / 2));
            return from_frames(motion, widest(principal_components(motion.positions_mm, axes), count));
        }
        case KeyShapeMethod::kClusters2:
        case KeyShapeMethod::kClusters3: {
            const Index d = std::min<Index>(rows, method == KeyShapeMethod::kClusters2 ? 2 : 3);
            return cluster_means(motion, principal_components(motion.positions_mm, d), count);
        }
        case KeyShapeMethod::kHull:
            break;
    }
    const MatrixXd plane = principal_components(motion.positions_mm, std::min<Index>(rows, 2));
    std::vector<Index> hull = convex_hull(plane);
    thin_hull(plane, count == 0 ? kMaxRegionShapes : std::min(count, kMaxRegionShapes), hull);
    return from_frames(motion, std::move(hull));
}

MatrixXd key_shape_weights(const MatrixXd& positions_mm, const MatrixXd& shapes_mm, double& worst_kkt) {
    const Index k = shapes_mm.rows();
    const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> gram =
        shapes_mm * shapes_mm.transpose();
    const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> linear =
        positions_mm * shapes_mm.transpose();
    const auto state = std::make_unique<NnlsState>();
    const auto workspace = std::make_unique<NnlsWorkspace>();
    MatrixXd weights(positions_mm.rows(), k);
    std::array<double, kMaxRegionShapes> w{};
    const auto n = static_cast<std::size_t>(k);
    worst_kkt = 0.0;
    for (Index f = 0; f < positions_mm.rows(); ++f) {
        const NnlsProblem problem{n, n, {gram.data(), n * n}, {linear.row(f).data(), n}};
        const BoxQpReport report = solve_nnls(problem, *state, *workspace, w);
        worst_kkt = std::max(worst_kkt, report.kkt);
        for (Index i = 0; i < k; ++i) weights(f, i) = w[static_cast<std::size_t>(i)];
    }
    return weights;
}

KeyShapeError key_shape_error(const MatrixXd& positions_mm, const KeyShapes& shapes) {
    KeyShapeError error;
    const MatrixXd weights = key_shape_weights(positions_mm, shapes.positions_mm, error.worst_kkt);
    error.sum_mm2 = (positions_mm - weights * shapes.positions_mm).squaredNorm();
    error.rms_mm = std::sqrt(error.sum_mm2 / static_cast<double>(positions_mm.size()));
    error.largest_weight = weights.maxCoeff();
    return error;
}

}  // namespace rig::host
