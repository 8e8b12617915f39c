#include "firmware_host/companion/train/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace rig::host {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr double kLostWidths = 3.0;

// The smallest value that at least this share of the values does not exceed; `sorted` is not empty.
double quantile(const std::vector<double>& sorted, double share) {
    const auto at = static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size())));
    return sorted[std::clamp<std::size_t>(at, 1, sorted.size()) - 1];
}

MatrixXd matrix_of(std::span<const float> values, Index rows) {
    const Index columns = rows > 0 ? static_cast<Index>(values.size()) / rows : 0;
    return Eigen::Map<const FloatRows>(values.data(), rows, columns).cast<double>();
}

}  // namespace

Coverage coverage_of(const MatrixXd& points, const MatrixXd& centres, const VectorXd& widths) {
    Coverage out;
    if (points.rows() == 0 || centres.rows() == 0) return out;
    out.frames = static_cast<std::size_t>(points.rows());
    std::vector<double> in_widths;
    std::vector<double> in_mm;
    for (Index f = 0; f < points.rows(); ++f) {
        const VectorXd gaps = (centres.rowwise() - points.row(f)).rowwise().norm();
        in_mm.push_back(gaps.minCoeff());
        in_widths.push_back(gaps.cwiseQuotient(widths).minCoeff());
    }
    std::ranges::sort(in_widths);
    std::ranges::sort(in_mm);
    const auto share_within = [&](double limit) {
        const auto end = std::ranges::upper_bound(in_widths, limit);
        return static_cast<double>(end - in_widths.begin()) / static_cast<double>(in_widths.size());
    };
    out.covered_share = share_within(1.0);
    out.lost_share = 1.0 - share_within(kLostWidths);
    for (std::size_t q = 0; q < kCoverageQuantiles.size(); ++q) {
        out.widths[q] = quantile(in_widths, kCoverageQuantiles[q]);
        out.distance_mm[q] = quantile(in_mm, kCoverageQuantiles[q]);
    }
    const MatrixXd centred = points.rowwise() - points.colwise().mean();
    out.spread_mm = std::sqrt(centred.squaredNorm() / static_cast<double>(points.rows()));
    return out;
}

Coverage coverage_of_takes(const RbfModel& rbf, std::span<const float> neutral_mm,
                           std::span<const float> basis_mm, std::span<const Take> takes) {
    const auto rows = static_cast<Index>(neutral_mm.size());
    const MatrixXd axes = matrix_of(rbf.basis, rbf.dimension_count);
    const MatrixXd b = matrix_of(basis_mm, rows);
    const VectorXd rest = axes * (matrix_of(neutral_mm, rows) - matrix_of(rbf.mean_mm, rows));
    const MatrixXd motion = axes * b;
    std::size_t frames = 0;
    for (const Take& take : takes) frames += take.frame_count;
    MatrixXd points(static_cast<Index>(frames), axes.rows());
    Index row = 0;
    for (const Take& take : takes) {
        const MatrixXd weights = matrix_of(take.weights, static_cast<Index>(take.frame_count));
        points.middleRows(row, weights.rows()) = (weights * motion.transpose()).rowwise() + rest.transpose();
        row += weights.rows();
    }
    return coverage_of(points, matrix_of(rbf.centres, rbf.centre_count),
                       matrix_of(rbf.widths_mm, rbf.centre_count));
}

}  // namespace rig::host
