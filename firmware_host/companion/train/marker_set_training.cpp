#include "firmware_host/companion/train/marker_set_training.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "firmware_host/companion/train/take_statistics.hpp"

namespace rig::host {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Variance under which a direction is the rounding of a basis in float32, relative to the largest.
constexpr double kRankShare = 1e-10;
constexpr double kLeastVarianceMm2 = 1e-6;  // a thousandth of a millimetre; what a pack takes is above it

MatrixXd rows_of(const MarkerSet& set, std::span<const float> basis_mm, std::size_t n) {
    MatrixXd out(static_cast<Index>(3 * set.markers.size()), static_cast<Index>(n));
    for (Index r = 0; r < out.rows(); ++r) {
        const auto row = static_cast<std::size_t>(r);
        const std::size_t from = 3U * set.markers[row / 3] + row % 3;
        for (std::size_t i = 0; i < n; ++i)
            out(r, static_cast<Index>(i)) = static_cast<double>(basis_mm[from * n + i]);
    }
    return out;
}

TrainedMarkerSet train_one(const MarkerSet& set, const MatrixXd& basis, const ExpressionSpread& spread,
                           std::size_t most_modes) {
    const VectorXd mean = basis * spread.mean;
    const MatrixXd covariance = basis * spread.covariance * basis.transpose();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(covariance);
    const Index rows = covariance.rows();
    const double least = std::max(kLeastVarianceMm2, kRankShare * solver.eigenvalues()[rows - 1]);
    TrainedMarkerSet out{set.name, set.level, 0, set.markers, {}, {}, {}, {}};
    VectorXd left = covariance.diagonal();
    // Eigenvalues rise.
    for (Index j = rows - 1; j >= 0 && out.mode_count < most_modes; --j) {
        const double variance = std::max(solver.eigenvalues()[j], kLeastVarianceMm2);
        if (out.mode_count > 0 && !(solver.eigenvalues()[j] > least)) break;
        VectorXd mode = solver.eigenvectors().col(j);
        Index largest = 0;
        mode.cwiseAbs().maxCoeff(&largest);
        if (mode[largest] < 0.0) mode = -mode;  // the sign of an eigenvector is anybody's choice
        for (const double x : mode) out.modes.push_back(static_cast<float>(x));
        out.variance_mm2.push_back(static_cast<float>(variance));
        left -= solver.eigenvalues()[j] * mode.cwiseAbs2();
        ++out.mode_count;
    }
    for (const double x : mean) out.mean_mm.push_back(static_cast<float>(x));
    for (Index k = 0; k < rows / 3; ++k)
        out.residual_mm2.push_back(static_cast<float>(std::max(0.0, left.segment(3 * k, 3).mean())));
    return out;
}

}  // namespace

MarkerSetModel TrainedMarkerSet::view() const {
    MarkerSetModel out;
    out.name = name;
    out.level = level;
    out.marker_count = static_cast<std::uint16_t>(markers.size());
    out.mode_count = static_cast<std::uint16_t>(mode_count);
    out.markers = markers;
    out.mean_mm = mean_mm;
    out.modes = modes;
    out.variance_mm2 = variance_mm2;
    out.residual_mm2 = residual_mm2;
    return out;
}

ExpressionSpread spread_of_rig(std::size_t shape_count) {
    const auto n = static_cast<Index>(shape_count);
    return {VectorXd::Constant(n, kDefaultMean), kDefaultSigma * kDefaultSigma * MatrixXd::Identity(n, n)};
}

ExpressionSpread spread_of_expressions(const MatrixXd& weights) {
    ExpressionSpread out;
    out.mean = weights.colwise().mean();
    const MatrixXd centred = weights.rowwise() - out.mean.transpose();
    out.covariance = centred.transpose() * centred / static_cast<double>(weights.rows());
    return out;
}

ExpressionSpread spread_of_takes(std::span<const Take> takes, std::size_t shape_count) {
    const ExpressionSpread rig = spread_of_rig(shape_count);
    std::size_t frames = 0;
    for (const Take& take : takes) frames += take.frame_count;
    if (frames == 0) return rig;
    MatrixXd weights(static_cast<Index>(frames), static_cast<Index>(shape_count));
    Index row = 0;
    for (const Take& take : takes) {
        for (std::size_t f = 0; f < take.frame_count; ++f, ++row) {
            for (std::size_t i = 0; i < shape_count; ++i)
                weights(row, static_cast<Index>(i)) = static_cast<double>(take.weights[f * shape_count + i]);
        }
    }
    const ExpressionSpread seen = spread_of_expressions(weights);
    ExpressionSpread out;
    const double share = 1.0 - kRigShare;
    out.mean = share * seen.mean + kRigShare * rig.mean;
    const VectorXd apart = seen.mean - rig.mean;
    out.covariance = share * seen.covariance + kRigShare * rig.covariance +
                     share * kRigShare * (apart * apart.transpose());
    return out;
}

std::vector<TrainedMarkerSet> train_marker_sets(std::span<const MarkerSet> plan,
                                                std::span<const float> basis_mm,
                                                const ExpressionSpread& spread,
                                                const MarkerSetOptions& options) {
    std::vector<TrainedMarkerSet> out;
    for (const MarkerSet& set : plan) {
        const MatrixXd basis = rows_of(set, basis_mm, static_cast<std::size_t>(spread.mean.size()));
        const std::size_t most = set.level == 0 ? options.face_modes : options.set_modes;
        out.push_back(train_one(set, basis, spread, std::clamp<std::size_t>(most, 1, kMaxModes)));
    }
    return out;
}

}  // namespace rig::host
