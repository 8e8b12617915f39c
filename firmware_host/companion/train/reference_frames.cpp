#include "firmware_host/companion/train/reference_frames.hpp"

#include <algorithm>
#include <limits>

namespace rig::host {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kClusteredFrames = 4000;  // more neighbours of the same moments teach a clustering nothing
constexpr int kLloydRounds = 30;

// Squared distance of every row to `point`.
VectorXd distances(const MatrixXd& rows, const Eigen::RowVectorXd& point) {
    return (rows.rowwise() - point).rowwise().squaredNorm();
}

std::vector<Index> widest_spread(const MatrixXd& rows, std::size_t count) {
    std::vector<Index> chosen(1);
    distances(rows, rows.colwise().mean()).maxCoeff(&chosen[0]);
    VectorXd nearest = distances(rows, rows.row(chosen[0]));
    while (chosen.size() < count) {
        Index farthest = 0;
        if (nearest.maxCoeff(&farthest) <= 0.0) break;  // all that is left repeats what is there
        chosen.push_back(farthest);
        nearest = nearest.cwiseMin(distances(rows, rows.row(farthest)));
    }
    return chosen;
}

// Index of the nearest centre for every row.
std::vector<Index> assign(const MatrixXd& rows, const MatrixXd& centres) {
    std::vector<Index> owner(static_cast<std::size_t>(rows.rows()));
    VectorXd nearest = VectorXd::Constant(rows.rows(), std::numeric_limits<double>::infinity());
    for (Index k = 0; k < centres.rows(); ++k) {
        const VectorXd gaps = distances(rows, centres.row(k));
        for (Index r = 0; r < rows.rows(); ++r) {
            if (gaps[r] < nearest[r]) {
                nearest[r] = gaps[r];
                owner[static_cast<std::size_t>(r)] = k;
            }
        }
    }
    return owner;
}

void move_to_means(const MatrixXd& rows, const std::vector<Index>& owner, MatrixXd& centres) {
    MatrixXd sums = MatrixXd::Zero(centres.rows(), centres.cols());
    VectorXd counts = VectorXd::Zero(centres.rows());
    for (Index r = 0; r < rows.rows(); ++r) {
        sums.row(owner[static_cast<std::size_t>(r)]) += rows.row(r);
        counts[owner[static_cast<std::size_t>(r)]] += 1.0;
    }
    for (Index k = 0; k < centres.rows(); ++k) {
        if (counts[k] > 0.0) centres.row(k) = sums.row(k) / counts[k];
    }
}

}  // namespace

FrameClusters cluster_frames(const MatrixXd& rows, const std::vector<Index>& starts) {
    MatrixXd centres(static_cast<Index>(starts.size()), rows.cols());
    for (std::size_t k = 0; k < starts.size(); ++k) centres.row(static_cast<Index>(k)) = rows.row(starts[k]);
    std::vector<Index> owner;
    for (int round = 0; round < kLloydRounds; ++round) {
        std::vector<Index> now = assign(rows, centres);
        if (now == owner) break;
        owner = std::move(now);
        move_to_means(rows, owner, centres);
    }
    return {std::move(centres), std::move(owner)};
}

std::vector<Index> choose_reference_frames(const MatrixXd& points, std::size_t count) {
    const Index stride = std::max<Index>(1, points.rows() / kClusteredFrames);
    const Index kept = (points.rows() + stride - 1) / stride;
    MatrixXd rows(kept, points.cols());
    for (Index r = 0; r < kept; ++r) rows.row(r) = points.row(r * stride);
    const MatrixXd centres =
        cluster_frames(rows, widest_spread(rows, std::max<std::size_t>(count, 1))).centres;
    std::vector<Index> chosen;
    for (Index k = 0; k < centres.rows(); ++k) {
        Index nearest = 0;
        distances(rows, centres.row(k)).minCoeff(&nearest);
        chosen.push_back(nearest * stride);
    }
    std::ranges::sort(chosen);
    const auto repeated = std::ranges::unique(chosen);
    chosen.erase(repeated.begin(), repeated.end());
    return chosen;
}

}  // namespace rig::host
