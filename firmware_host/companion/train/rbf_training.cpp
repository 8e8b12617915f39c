#include "firmware_host/companion/train/rbf_training.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "firmware_host/companion/train/gcv.hpp"
#include "firmware_host/companion/train/reference_frames.hpp"
#include "firmware_host/companion/train/white_noise.hpp"

namespace rig::host {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr std::size_t kLeastFrames = 40;
constexpr std::size_t kFramesPerReference =
    4;                                  // fewer, and the references are the take: nothing is left to judge by
constexpr Index kBlocks = 5;            // of the take, left out in turn
constexpr Index kJudgedPerBlock = 400;  // frames
constexpr Index kNeighbours = 3;        // whose mean distance is the local spacing of a centre
constexpr std::array kWidthFactors{1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0};
constexpr std::array<Index, 12> kDimensions{1, 2, 3, 4, 6, 8, 12, 16, 20, 24, 28, 32};
constexpr double kLeastRelativeLambda =
    1e-8;  // of the largest eigenvalue: keeps weights representable as float32

// The take as the regression sees it.
struct Frames {
    MatrixXd weights;       // F x N
    VectorXd mean_weights;  // N
    MatrixXd basis;         // D x 3m, the principal axes as rows, D the most that is worth keeping
    VectorXd mean_mm;       // 3m
    MatrixXd clean;         // F x D, projected without noise: references are taken from here
    MatrixXd seen;          // F x D, with noise: models are judged on these
    VectorXd variance_mm2;  // D
    double total_variance_mm2 = 0.0;
};

MatrixXd weights_of(std::span<const Take> takes, std::size_t shape_count) {
    std::size_t frames = 0;
    for (const Take& take : takes) frames += take.frame_count;
    MatrixXd out(static_cast<Index>(frames), static_cast<Index>(shape_count));
    Index row = 0;
    for (const Take& take : takes) {
        for (std::size_t f = 0; f < take.frame_count; ++f, ++row) {
            for (std::size_t i = 0; i < shape_count; ++i) {
                out(row, static_cast<Index>(i)) = static_cast<double>(take.weights[f * shape_count + i]);
            }
        }
    }
    return out;
}

// Principal axes of all frames. Markers are neutral + B w, so their covariance is B Cov(w) B^T, exactly;
// white marker noise adds the same to every direction and turns none.
void find_axes(const MatrixXd& b, const VectorXd& neutral, double noise_mm, Frames& frames) {
    const MatrixXd centred = frames.weights.rowwise() - frames.mean_weights.transpose();
    const MatrixXd weight_covariance = centred.transpose() * centred / static_cast<double>(centred.rows());
    const MatrixXd covariance = b * weight_covariance * b.transpose();
    frames.mean_mm = neutral + b * frames.mean_weights;
    frames.total_variance_mm2 = covariance.trace();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(covariance);
    const Index limit = std::min<Index>({static_cast<Index>(kMaxRbfDimensions), b.rows(), b.cols()});
    Index kept = 0;
    // An axis along which the face moves less than the noise says nothing.
    while (kept < limit && eigen.eigenvalues()[b.rows() - 1 - kept] > noise_mm * noise_mm) ++kept;
    frames.basis.resize(kept, b.rows());
    frames.variance_mm2.resize(kept);
    for (Index a = 0; a < kept; ++a) {
        VectorXd axis = eigen.eigenvectors().col(b.rows() - 1 - a);
        Index largest = 0;
        axis.cwiseAbs().maxCoeff(&largest);
        if (axis[largest] < 0.0) axis = -axis;  // a sign of its own, not the solver's
        frames.basis.row(a) = axis.transpose();
        frames.variance_mm2[a] = eigen.eigenvalues()[b.rows() - 1 - a];
    }
    frames.clean = centred * (frames.basis * b).transpose();
    frames.seen = frames.clean;
    WhiteNoise noise(20061);
    for (Index r = 0; r < frames.seen.rows(); ++r) {
        for (Index c = 0; c < frames.seen.cols(); ++c) frames.seen(r, c) += noise_mm * noise.next();
    }
}

struct Model {
    RbfKernel kernel = RbfKernel::kGaussian;
    MatrixXd centres;  // K x d
    VectorXd widths;   // K
    MatrixXd weights;  // K x N
    VectorXd offset;   // N
    double median_lambda = 0.0;
    std::vector<GcvPath> gcv_paths;  // of each weight
};

VectorXd local_widths(const MatrixXd& centres, double factor, double least) {
    VectorXd widths(centres.rows());
    std::vector<double> distances;
    for (Index k = 0; k < centres.rows(); ++k) {
        distances.clear();
        for (Index j = 0; j < centres.rows(); ++j) {
            if (j != k) distances.push_back((centres.row(k) - centres.row(j)).norm());
        }
        std::ranges::sort(distances);
        const auto count = std::min<std::size_t>(distances.size(), static_cast<std::size_t>(kNeighbours));
        const double sum =
            std::accumulate(distances.begin(), distances.begin() + static_cast<std::ptrdiff_t>(count), 0.0);
        widths[k] = std::max(least, factor * sum / static_cast<double>(std::max<std::size_t>(count, 1)));
    }
    return widths;
}

// phi(u) and its derivative, the same functions as core's (solve_pack.hpp).
Eigen::ArrayXd kernel_of(RbfKernel kernel, const Eigen::ArrayXd& u) {
    switch (kernel) {
        case RbfKernel::kThinPlate:
            return (u > 0.0).select(0.5 * u * u.max(1e-300).log(), 0.0);
        case RbfKernel::kMultiquadric:
            return (1.0 + u).sqrt();
        case RbfKernel::kGaussian:
            break;
    }
    return (-0.5 * u).exp();
}
Eigen::ArrayXd kernel_slope(RbfKernel kernel, const Eigen::ArrayXd& u) {
    switch (kernel) {
        case RbfKernel::kThinPlate:
            return (u > 0.0).select(0.5 * (u.max(1e-300).log() + 1.0),
                                    0.0);  // at 0 it is multiplied by r = 0
        case RbfKernel::kMultiquadric:
            return 0.5 / (1.0 + u).sqrt();
        case RbfKernel::kGaussian:
            break;
    }
    return -0.5 * (-0.5 * u).exp();
}

Eigen::ArrayXd squared_in_widths(const MatrixXd& points, const Model& model, Index k) {
    return (points.rowwise() - model.centres.row(k)).rowwise().squaredNorm().array() /
           (model.widths[k] * model.widths[k]);
}

MatrixXd heights(const MatrixXd& points, const Model& model) {
    MatrixXd h(points.rows(), model.centres.rows());
    for (Index k = 0; k < model.centres.rows(); ++k) {
        h.col(k) = kernel_of(model.kernel, squared_in_widths(points, model, k));
    }
    return h;
}

// Training with noisy inputs is a ridge: the expected square of noise times the slope of the heights
// [Bishop 1995]. Per mm^2 of noise, mean over the references.
double squared_slope(const Model& model) {
    double sum = 0.0;
    for (Index k = 0; k < model.centres.rows(); ++k) {
        const Eigen::ArrayXd u = squared_in_widths(model.centres, model, k);
        // |d phi / d x| = |phi'(u)| 2 r / s^2, r^2 = u s^2
        sum += (4.0 * kernel_slope(model.kernel, u).square() * u).sum() / (model.widths[k] * model.widths[k]);
    }
    return sum / static_cast<double>(model.centres.rows());
}

// What of a model is chosen, not fitted.
struct Settings {
    RbfKernel kernel = RbfKernel::kGaussian;
    Index dimensions = 1;
    double factor = 2.0;
    double noise_mm = 0.1;
};

Model fit(const Frames& frames, const std::vector<Index>& references, const Settings& settings) {
    const Index dimensions = settings.dimensions;
    const double noise_mm = settings.noise_mm;
    const auto count = static_cast<Index>(references.size());
    Model model;
    model.kernel = settings.kernel;
    model.centres.resize(count, dimensions);
    MatrixXd y(count, frames.weights.cols());
    for (Index k = 0; k < count; ++k) {
        model.centres.row(k) = frames.clean.row(references[static_cast<std::size_t>(k)]).head(dimensions);
        y.row(k) = frames.weights.row(references[static_cast<std::size_t>(k)]);
    }
    model.offset = y.colwise().mean().transpose();
    y.rowwise() -= model.offset.transpose();
    model.widths = local_widths(model.centres, settings.factor, std::max(noise_mm, 0.01));
    // r^2 ln r is one function of the distance; widths that differ would tear it apart.
    if (settings.kernel == RbfKernel::kThinPlate) model.widths.setConstant(model.widths.mean());
    const MatrixXd h = heights(model.centres, model);
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(h * h.transpose());
    const VectorXd mu = eigen.eigenvalues().cwiseMax(0.0);
    const MatrixXd z = eigen.eigenvectors().transpose() * y;
    const double least =
        std::max(kLeastRelativeLambda * mu.maxCoeff(), noise_mm * noise_mm * squared_slope(model));
    MatrixXd shrunk(count, y.cols());
    std::vector<double> lambdas;
    for (Index j = 0; j < y.cols(); ++j) {
        model.gcv_paths.push_back(minimise_gcv(mu, z.col(j), least));
        lambdas.push_back(model.gcv_paths.back().back().lambda);
        shrunk.col(j) = z.col(j).array() / (mu.array() + lambdas.back());
    }
    model.weights = h.transpose() * (eigen.eigenvectors() * shrunk);
    std::ranges::nth_element(lambdas, lambdas.begin() + static_cast<std::ptrdiff_t>(lambdas.size() / 2));
    model.median_lambda = lambdas[lambdas.size() / 2];
    return model;
}

MatrixXd predict(const Model& model, const MatrixXd& points) {
    const MatrixXd raw = (heights(points, model) * model.weights).rowwise() + model.offset.transpose();
    return raw.cwiseMax(0.0).cwiseMin(1.0);
}

// Mean square error of all weights over blocks of the take, each judged by a model without that block's
// references.
double cross_validated(const Frames& frames, const std::vector<Index>& references, const Settings& settings) {
    const Index total = frames.weights.rows();
    double sum = 0.0;
    double counted = 0.0;
    for (Index block = 0; block < kBlocks; ++block) {
        const Index begin = block * total / kBlocks;
        const Index end = (block + 1) * total / kBlocks;
        std::vector<Index> others;
        std::ranges::copy_if(references, std::back_inserter(others),
                             [&](Index f) { return f < begin || f >= end; });
        if (others.size() < 2) continue;
        const Model model = fit(frames, others, settings);
        const Index stride = std::max<Index>(1, (end - begin) / kJudgedPerBlock);
        const Index judged = (end - begin + stride - 1) / stride;
        MatrixXd points(judged, settings.dimensions);
        MatrixXd truth(judged, frames.weights.cols());
        for (Index i = 0; i < judged; ++i) {
            points.row(i) = frames.seen.row(begin + i * stride).head(settings.dimensions);
            truth.row(i) = frames.weights.row(begin + i * stride);
        }
        sum += (predict(model, points) - truth).squaredNorm();
        counted += static_cast<double>(truth.size());
    }
    return counted > 0.0 ? sum / counted : std::numeric_limits<double>::infinity();
}

// What cross-validation chose, and what it saw on the way.
struct Choice {
    Settings settings;
    double mean_square = std::numeric_limits<double>::infinity();
    std::vector<CrossValidation> tried;
};

// Widths at a middling number of components, then the components, then the widths again: the two hardly
// interact.
Choice choose(const Frames& frames, const std::vector<Index>& references, const RbfTrainingOptions& options,
              double noise_mm, const TrainingProgress& progress) {
    const Index most = frames.basis.rows();
    const Index wanted = options.dimensions > 0 ? static_cast<Index>(options.dimensions) : Index{8};
    Choice best;
    best.settings = {options.kernel, std::min(most, wanted), 2.0, noise_mm};
    const double steps = 2.0 * kWidthFactors.size() + kDimensions.size();
    const auto consider = [&](Index dimensions, double factor) {
        const Settings settings{options.kernel, dimensions, factor, noise_mm};
        const double mean_square = cross_validated(frames, references, settings);
        best.tried.push_back({static_cast<std::size_t>(dimensions), factor, std::sqrt(mean_square)});
        if (mean_square < best.mean_square) {
            best.settings = settings;
            best.mean_square = mean_square;
        }
        if (progress) progress(std::min(1.0, static_cast<double>(best.tried.size()) / steps));
    };
    const Index first_dimensions = best.settings.dimensions;
    for (const double factor : kWidthFactors) consider(first_dimensions, factor);
    if (options.dimensions > 0) return best;
    const double first_factor = best.settings.factor;
    for (const Index dimensions : kDimensions) {
        if (dimensions <= most) consider(dimensions, first_factor);
    }
    const Index chosen = best.settings.dimensions;
    for (const double factor : kWidthFactors) consider(chosen, factor);
    return best;
}

TrainedRbf to_pack(const Frames& frames, const Model& model, const RbfTrainingOptions& options) {
    const auto floats = [](const MatrixXd& values) {
        const FloatRows rows = values.cast<float>();
        return std::vector<float>(rows.data(), rows.data() + rows.size());
    };
    const Index d = model.centres.cols();
    TrainedRbf out;
    out.kernel = model.kernel;
    out.hull_near_widths = static_cast<float>(options.hull_near_widths);
    out.hull_far_widths = static_cast<float>(options.hull_far_widths);
    out.dimension_count = static_cast<std::uint16_t>(d);
    out.centre_count = static_cast<std::uint16_t>(model.centres.rows());
    out.mean_mm = floats(frames.mean_mm);
    out.basis = floats(frames.basis.topRows(d));
    out.centres = floats(model.centres);
    out.widths_mm = floats(model.widths);
    out.weights = floats(model.weights);
    out.offset = floats(model.offset);
    return out;
}

// Of each point to its nearest centre, in that centre's widths.
std::vector<double> distances_of(const Model& model, const MatrixXd& points) {
    Eigen::ArrayXd nearest = squared_in_widths(points, model, 0);
    for (Index k = 1; k < model.centres.rows(); ++k)
        nearest = nearest.min(squared_in_widths(points, model, k));
    const Eigen::ArrayXd distances = nearest.sqrt();
    return {distances.begin(), distances.end()};
}

RbfTrainingReport describe(const Frames& frames, const MatrixXd& b, const Model& model,
                           const Choice& choice) {
    const Index d = model.centres.cols();
    const MatrixXd error = predict(model, frames.seen.leftCols(d)) - frames.weights;
    double visible = 0.0;
    double visible_count = 0.0;
    for (Index i = 0; i < b.cols(); ++i) {
        if (b.col(i).norm() <= 1.0) continue;
        visible += error.col(i).squaredNorm();
        visible_count += static_cast<double>(error.rows());
    }
    RbfTrainingReport report;
    report.frames = static_cast<std::size_t>(frames.weights.rows());
    report.dimensions = static_cast<std::size_t>(d);
    report.centres = static_cast<std::size_t>(model.centres.rows());
    report.variance_kept = frames.variance_mm2.head(d).sum() / frames.total_variance_mm2;
    report.width_factor = choice.settings.factor;
    report.median_lambda = model.median_lambda;
    report.cross_validated_rms = std::sqrt(choice.mean_square);
    std::vector<double> distances = distances_of(model, frames.seen.leftCols(d));
    std::ranges::sort(distances);
    report.distance_p50 = distances[distances.size() / 2];
    report.distance_p95 = distances[distances.size() * 95 / 100];
    report.cross_validation = choice.tried;
    report.gcv_paths = model.gcv_paths;
    const VectorXd shares = frames.variance_mm2 / frames.total_variance_mm2;
    report.variance_shares.assign(shares.begin(), shares.end());
    report.in_take_rms = std::sqrt(error.squaredNorm() / static_cast<double>(error.size()));
    report.visible_in_take_rms = visible_count > 0.0 ? std::sqrt(visible / visible_count) : 0.0;
    return report;
}

}  // namespace

RbfModel view_of(const TrainedRbf& trained) {
    return {.kernel = trained.kernel,
            .hull_near_widths = trained.hull_near_widths,
            .hull_far_widths = trained.hull_far_widths,
            .dimension_count = trained.dimension_count,
            .centre_count = trained.centre_count,
            .mean_mm = trained.mean_mm,
            .basis = trained.basis,
            .centres = trained.centres,
            .widths_mm = trained.widths_mm,
            .weights = trained.weights,
            .offset = trained.offset};
}

Result<RbfTraining, FileError> train_rbf(std::span<const float> neutral_mm, std::span<const float> basis_mm,
                                         std::span<const Take> takes, double noise_mm,
                                         const RbfTrainingOptions& options,
                                         const TrainingProgress& progress) {
    const auto rows = static_cast<Index>(neutral_mm.size());
    const auto n = static_cast<Index>(basis_mm.size()) / rows;
    if (options.centres < 2 || options.centres > kMaxRbfCentres || options.dimensions > kMaxRbfDimensions) {
        return failure(FileError{fmt::format("an RBF has 2 to {} reference frames and at most {} dimensions",
                                             kMaxRbfCentres, kMaxRbfDimensions)});
    }
    Frames frames;
    frames.weights = weights_of(takes, static_cast<std::size_t>(n));
    const auto total = static_cast<std::size_t>(frames.weights.rows());
    if (total < kLeastFrames) {
        return failure(FileError{
            fmt::format("the takes have {} frames; an RBF needs {} to learn from", total, kLeastFrames)});
    }
    frames.mean_weights = frames.weights.colwise().mean().transpose();
    const MatrixXd b = Eigen::Map<const FloatRows>(basis_mm.data(), rows, n).cast<double>();
    const VectorXd neutral = Eigen::Map<const Eigen::VectorXf>(neutral_mm.data(), rows).cast<double>();
    find_axes(b, neutral, noise_mm, frames);
    if (frames.basis.rows() == 0) {
        return failure(FileError{
            "the takes move the markers by less than their noise; an RBF learns from a performance that "
            "moves the face"});
    }
    const std::vector<Index> references =
        choose_reference_frames(frames.clean, std::min(options.centres, total / kFramesPerReference));
    const Choice choice = choose(frames, references, options, noise_mm, progress);
    const Model model = fit(frames, references, choice.settings);
    return RbfTraining{to_pack(frames, model, options), describe(frames, b, model, choice)};
}

}  // namespace rig::host
