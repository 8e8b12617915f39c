#include "firmware_host/companion/report/pack_analysis.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "firmware_host/companion/fit/take_solve.hpp"
#include "firmware_host/companion/train/white_noise.hpp"

namespace rig::host {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr double kRankShare = 1e-6;  // B is float32: what is smaller than its rounding is no direction
constexpr double kVisibleMm = 1.0;
constexpr std::size_t kMostTakeFrames = 10'000;
constexpr std::uint64_t kNoiseSeed = 1620;

MatrixXd basis_of(const SolvePack& pack) {
    return Eigen::Map<const FloatRows>(pack.basis_mm.data(), 3 * pack.marker_count, pack.shape_count)
        .cast<double>();
}

VectorXd vector_of(std::span<const float> values) {
    return Eigen::Map<const Eigen::VectorXf>(values.data(), static_cast<Index>(values.size())).cast<double>();
}

double square(double x) {
    return x * x;
}

void describe_shapes(const SolvePack& pack, const MatrixXd& b, const MatrixXd& posterior, PackAnalysis& out) {
    for (Index i = 0; i < b.cols(); ++i) {
        const auto at = static_cast<std::size_t>(i);
        ShapeFigures shape;
        shape.name = pack.shape_names[at];
        shape.column_mm = b.col(i).norm();
        shape.prior_mean = static_cast<double>(pack.prior_mean[at]);
        shape.prior_sigma = static_cast<double>(pack.prior_sigma[at]);
        shape.posterior_sigma = std::sqrt(std::max(0.0, posterior(i, i)));
        shape.confidence = std::clamp(1.0 - shape.posterior_sigma / shape.prior_sigma, 0.0, 1.0);
        shape.temporal_gamma_mm2 = static_cast<double>(pack.temporal_gamma[at]);
        out.shapes.push_back(std::move(shape));
    }
}

void describe_markers(const SolvePack& pack, const MatrixXd& b, const MatrixXd& posterior,
                      PackAnalysis& out) {
    double lowest = 0.0;
    for (std::size_t k = 0; k < pack.marker_count; ++k)
        lowest = std::min(lowest, static_cast<double>(pack.neutral_mm[3 * k + 1]));
    for (std::size_t k = 0; k < pack.marker_count; ++k) {
        MarkerFigures marker;
        marker.name = pack.marker_names[k];
        for (std::size_t a = 0; a < 3; ++a)
            marker.neutral_mm[a] = static_cast<double>(pack.neutral_mm[3 * k + a]);
        marker.region = region_of(marker.neutral_mm[0], marker.neutral_mm[1], std::max(1.0, -lowest));
        const MatrixXd rows = b.middleRows(static_cast<Index>(3 * k), 3);
        marker.predicted_mm = std::sqrt(std::max(0.0, (rows * posterior * rows.transpose()).trace()));
        out.markers.push_back(std::move(marker));
    }
}

void describe_conditioning(const MatrixXd& b, PackAnalysis& out) {
    const VectorXd values = Eigen::BDCSVD<MatrixXd>(b).singularValues();
    out.singular_values_mm.assign(values.begin(), values.end());
    for (const double value : out.singular_values_mm) {
        if (value <= kRankShare * values[0]) break;
        ++out.rank;
        out.condition = values[0] / value;
    }
}

void describe_regions(PackAnalysis& out) {
    for (std::size_t r = 0; r < kFaceRegions; ++r) {
        RegionFigures region;
        region.region = static_cast<FaceRegion>(r);
        double predicted = 0.0;
        double measured = 0.0;
        for (const MarkerFigures& marker : out.markers) {
            if (marker.region != region.region) continue;
            ++region.markers;
            predicted += square(marker.predicted_mm);
            measured += square(marker.error_rms_mm.value_or(0.0));
        }
        if (region.markers == 0) continue;
        const auto count = static_cast<double>(region.markers);
        region.predicted_mm = std::sqrt(predicted / count);
        if (out.take) region.error_rms_mm = std::sqrt(measured / count);
        out.regions.push_back(region);
    }
}

MarkerTake played(const SolvePack& pack, const MatrixXd& truth_mm, double rate_hz) {
    MarkerTake take{.frame_count = static_cast<std::size_t>(truth_mm.rows()),
                    .marker_count = pack.marker_count,
                    .rate_hz = rate_hz,
                    .positions_mm = {}};
    WhiteNoise white(kNoiseSeed);
    const auto noise = static_cast<double>(pack.noise_mm);
    for (Index f = 0; f < truth_mm.rows(); ++f) {
        for (Index k = 0; k < pack.marker_count; ++k) {
            Vec3 p;
            for (Index a = 0; a < 3; ++a) p[a] = truth_mm(f, 3 * k + a) + noise * white.next();
            take.positions_mm.push_back(p);
        }
    }
    return take;
}

void describe_take(const SolvePack& pack, const MatrixXd& b, const Take& take, PackAnalysis& out) {
    const auto frames = static_cast<Index>(std::min(take.frame_count, kMostTakeFrames));
    const MatrixXd weights =
        Eigen::Map<const FloatRows>(take.weights.data(), frames, pack.shape_count).cast<double>();
    const MatrixXd truth_mm = (weights * b.transpose()).rowwise() + vector_of(pack.neutral_mm).transpose();
    const SolvedTake solved = solve_take(pack, played(pack, truth_mm, take.rate_hz), false);
    const MatrixXd error = solved.weights - weights;
    const MatrixXd error_mm = error * b.transpose();
    const auto count = static_cast<double>(frames);
    TakeFigures figures;
    figures.frames = static_cast<std::size_t>(frames);
    figures.weight_rms = std::sqrt(error.squaredNorm() / static_cast<double>(error.size()));
    figures.marker_rms_mm = std::sqrt(error_mm.squaredNorm() / (count * pack.marker_count));
    double visible = 0.0;
    double visible_count = 0.0;
    for (std::size_t i = 0; i < out.shapes.size(); ++i) {
        const double squares = error.col(static_cast<Index>(i)).squaredNorm();
        out.shapes[i].error_rms = std::sqrt(squares / count);
        if (out.shapes[i].column_mm <= kVisibleMm) continue;
        visible += squares;
        visible_count += count;
    }
    if (visible_count > 0.0) figures.visible_weight_rms = std::sqrt(visible / visible_count);
    for (std::size_t k = 0; k < out.markers.size(); ++k) {
        out.markers[k].error_rms_mm =
            std::sqrt(error_mm.middleCols(static_cast<Index>(3 * k), 3).squaredNorm() / count);
    }
    if (pack.solver == SolverKind::kRbf)
        figures.coverage = coverage_of_takes(pack.rbf, pack.neutral_mm, pack.basis_mm, {&take, 1});
    out.take = figures;
}

}  // namespace

const char* region_name(FaceRegion region) {
    switch (region) {
        case FaceRegion::kForehead:
            return "forehead and brows";
        case FaceRegion::kEyes:
            return "around the eyes";
        case FaceRegion::kNose:
            return "nose";
        case FaceRegion::kCheeks:
            return "cheeks";
        case FaceRegion::kMouth:
            return "mouth";
        case FaceRegion::kJaw:
            return "chin and jaw";
    }
    return "?";
}

// Shares of the height from the eyes to the chin, about 100 mm on a grown head: brows begin at +0.1, the
// eyes' surroundings end at -0.2, nostrils at -0.45, the lower lip at -0.9; the nose is 0.2 to either side,
// the mouth's corners 0.35.
FaceRegion region_of(double x_mm, double y_mm, double height_mm) {
    const double x = std::abs(x_mm) / height_mm;
    const double y = y_mm / height_mm;
    if (y > 0.1) return FaceRegion::kForehead;
    if (x <= 0.2 && y > -0.45) return x <= 0.15 || y < -0.2 ? FaceRegion::kNose : FaceRegion::kEyes;
    if (y > -0.2) return FaceRegion::kEyes;
    if (x <= 0.35 && y > -0.9 && y <= -0.45) return FaceRegion::kMouth;
    if (y <= -0.75) return FaceRegion::kJaw;
    return FaceRegion::kCheeks;
}

Result<PackAnalysis, FileError> analyse_pack(const SolvePack& pack, const Take* take) {
    const auto n = static_cast<std::size_t>(pack.shape_count);
    if (take != nullptr && (take->shape_names.size() != n || take->frame_count == 0)) {
        return failure(FileError{fmt::format("the take has {} shapes and {} frames, the pack {} shapes",
                                             take->shape_names.size(), take->frame_count, n)});
    }
    PackAnalysis out;
    const MatrixXd b = basis_of(pack);
    const VectorXd sigma = vector_of(pack.prior_sigma);
    MatrixXd precision = b.transpose() * b / square(static_cast<double>(pack.noise_mm));
    precision.diagonal() += sigma.cwiseAbs2().cwiseInverse();
    const MatrixXd posterior = precision.llt().solve(MatrixXd::Identity(b.cols(), b.cols()));
    describe_shapes(pack, b, posterior, out);
    describe_markers(pack, b, posterior, out);
    describe_conditioning(b, out);
    if (take != nullptr) describe_take(pack, b, *take, out);
    describe_regions(out);
    return out;
}

}  // namespace rig::host
