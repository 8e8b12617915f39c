#include "firmware_host/companion/train/train.hpp"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "core/pack/manifest.hpp"
#include "firmware_host/companion/train/take_statistics.hpp"

namespace rig::host {

namespace {

std::vector<float> to_floats(const std::vector<double>& values) {
    std::vector<float> out(values.size());
    std::ranges::transform(values, out.begin(), [](double x) { return static_cast<float>(x); });
    return out;
}

bool within(double value, double low, double high) {
    return value >= low && value <= high;  // false for NaN
}

std::string fault_of_sizes(const Rig& rig, const MarkerLayout& layout) {
    const std::size_t m = layout.markers.size();
    const std::size_t n = rig.shapes.size();
    if (m < kMinMarkers || m > kMaxMarkers) {
        return fmt::format("the layout has {} markers; a pack holds {} to {}", m, kMinMarkers, kMaxMarkers);
    }
    if (n < 1 || n > kMaxShapes)
        return fmt::format("the rig has {} shapes; a pack holds 1 to {}", n, kMaxShapes);
    for (const SparseShape& shape : rig.shapes) {
        if (!is_plain_text(shape.name, kMaxNameBytes)) {
            return fmt::format("the shape name \"{}\" is not plain text of 1 to {} bytes",
                               printable(shape.name), kMaxNameBytes);
        }
    }
    for (const LayoutMarker& marker : layout.markers) {
        if (!is_plain_text(marker.name, kMaxNameBytes)) {
            return fmt::format("the marker name \"{}\" is not plain text of 1 to {} bytes",
                               printable(marker.name), kMaxNameBytes);
        }
    }
    return {};
}

void describe_basis(TrainedPack& pack) {
    const auto rows = static_cast<Eigen::Index>(pack.neutral_mm.size());
    const auto n = static_cast<Eigen::Index>(pack.shape_names.size());
    const Eigen::MatrixXd b =
        Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
            pack.basis_mm.data(), rows, n)
            .cast<double>();
    for (Eigen::Index i = 0; i < n; ++i) {
        const double column_mm = b.col(i).norm();
        if (column_mm < kInvisibleMm) {
            pack.report.invisible.push_back({pack.shape_names[static_cast<std::size_t>(i)], column_mm});
        }
    }
    const Eigen::VectorXd values = Eigen::BDCSVD<Eigen::MatrixXd>(b).singularValues();
    // B is float32: what is smaller than its rounding is no direction of its own.
    const double least = values.size() > 0 ? values[0] * 1e-6 : 0.0;
    for (Eigen::Index i = 0; i < values.size() && values[i] > least; ++i) {
        ++pack.report.rank;
        pack.report.condition = values[0] / values[i];
    }
}

void fill_priors(const TrainOptions& options, TrainedPack& pack) {
    const std::size_t n = pack.shape_names.size();
    const WeightStatistics statistics = weight_statistics(options.takes, n, options.rate_hz);
    pack.weight_low.assign(n, 0.0F);
    pack.weight_high.assign(n, 1.0F);
    pack.prior_mean = to_floats(statistics.mean);
    pack.prior_sigma = to_floats(statistics.sigma);

    // A pack whose regression falls back holds the box QP's numbers too.
    const bool box = options.solver == SolverKind::kBoxQp ||
                     (options.solver == SolverKind::kRbf && options.rbf.hull_far_widths > 0.0);
    const bool pull = options.temporal.mode == TemporalPull::Mode::kOn ||
                      (options.temporal.mode == TemporalPull::Mode::kSolversOwn && box);
    pack.temporal_gamma.assign(n, 0.0F);
    const double s2 = options.noise_mm * options.noise_mm;
    for (std::size_t i = 0; i < n && pull; ++i) {
        const double step = options.temporal.step.value_or(statistics.step[i]);
        pack.temporal_gamma[i] = static_cast<float>(s2 / (step * step));
    }
    const double summed = static_cast<double>(pack.neutral_mm.size()) * s2;
    pack.sparsity_mm2 = options.sparsity.value_or(box ? kDefaultSparsity : 0.0) * summed;
    pack.ridge_mm2 = options.ridge.value_or(box ? kDefaultRidge : 0.0) * summed;
}

}  // namespace

std::string fault_of_options(const TrainOptions& options, std::size_t take_count) {
    if (!within(options.rate_hz, 1.0, 1000.0)) return "the rate is outside 1 to 1000 Hz";
    if (!within(options.noise_mm, 1e-4, 100.0)) return "the marker noise is outside 0.0001 to 100 mm";
    if (options.sparsity && !within(*options.sparsity, 0.0, 1e3)) return "the sparsity is outside 0 to 1000";
    if (options.ridge && !within(*options.ridge, 0.0, 1e3)) return "the ridge is outside 0 to 1000";
    if (options.temporal.step && !within(*options.temporal.step, 1e-4, 10.0)) {
        return "the step of the temporal pull is outside 0.0001 to 10";
    }
    if (options.cameras.size() > kMaxCameras)
        return fmt::format("there are more than {} cameras", kMaxCameras);
    const double near_widths = options.rbf.hull_near_widths;
    const double far_widths = options.rbf.hull_far_widths;
    if (near_widths != 0.0 || far_widths != 0.0) {
        if (options.solver != SolverKind::kRbf) return "only an RBF has references to be far from";
        if (!within(far_widths, 0.0, 1000.0) || !within(near_widths, 0.0, 1000.0) ||
            !(near_widths < far_widths)) {
            return "the fallback's distances are two numbers of widths from 0 to 1000, the near one first";
        }
    }
    if (options.solver == SolverKind::kRbf && take_count == 0) {
        return "an RBF learns from a performance: give one with --take T.csv (frame,time_s and one column a "
               "shape), or "
               "choose --solver boxqp, which needs none";
    }
    if (is_regional(options.solver) && take_count == 0) {
        return "regions take their shapes from a performance: give one with --take T.csv (frame,time_s and "
               "one "
               "column a shape), or choose --solver boxqp, which needs none";
    }
    return {};
}

SolvePack TrainedPack::view() const {
    SolvePack out;
    out.marker_count = static_cast<std::uint16_t>(marker_names.size());
    out.shape_count = static_cast<std::uint16_t>(shape_names.size());
    out.solver = solver;
    out.rate_hz = static_cast<float>(rate_hz);
    out.neutral_mm = neutral_mm;
    out.basis_mm = basis_mm;
    out.weight_low = weight_low;
    out.weight_high = weight_high;
    out.prior_mean = prior_mean;
    out.prior_sigma = prior_sigma;
    out.temporal_gamma = temporal_gamma;
    out.noise_mm = static_cast<float>(noise_mm);
    out.sparsity_mm2 = static_cast<float>(sparsity_mm2);
    out.ridge_mm2 = static_cast<float>(ridge_mm2);
    out.rbf = view_of(rbf);
    out.region_count = static_cast<std::uint8_t>(std::min(regions.size(), kMaxRegions));
    for (std::size_t r = 0; r < out.region_count; ++r) out.regions[r] = regions[r].view();
    out.marker_set_count = static_cast<std::uint8_t>(std::min(marker_sets.size(), kMaxMarkerSets));
    for (std::size_t f = 0; f < out.marker_set_count; ++f) out.marker_sets[f] = marker_sets[f].view();
    out.camera_count = static_cast<std::uint8_t>(cameras.size());
    std::ranges::copy(cameras, out.cameras.begin());
    out.reference_mark_count =
        static_cast<std::uint8_t>(std::min(reference_marks.size(), kMaxReferenceMarks));
    std::copy_n(reference_marks.begin(), out.reference_mark_count, out.reference_marks.begin());
    std::ranges::copy(shape_names, out.shape_names.begin());
    std::ranges::copy(marker_names, out.marker_names.begin());
    return out;
}

Result<TrainedPack, FileError> train(const Rig& rig, const MarkerLayout& layout, const TrainOptions& options,
                                     const TrainingProgress& progress) {
    if (const std::string fault = fault_of_options(options, options.takes.size()); !fault.empty())
        return failure(FileError{fault});
    if (const std::string fault = fault_of_sizes(rig, layout); !fault.empty())
        return failure(FileError{fault});
    TrainedPack pack;
    pack.solver = options.solver;
    pack.rate_hz = options.rate_hz;
    pack.noise_mm = options.noise_mm;
    pack.cameras = options.cameras;
    pack.reference_marks = options.reference_marks;
    for (const SparseShape& shape : rig.shapes) pack.shape_names.push_back(shape.name);
    for (const LayoutMarker& marker : layout.markers) pack.marker_names.push_back(marker.name);
    MarkerModel model = marker_model(rig, layout);
    pack.neutral_mm = std::move(model.neutral_mm);
    pack.basis_mm = std::move(model.basis_mm);
    fill_priors(options, pack);
    describe_basis(pack);
    if (options.marker_sets) {
        pack.marker_sets = train_marker_sets(marker_sets(layout), pack.basis_mm,
                                             spread_of_takes(options.takes, pack.shape_names.size()));
    }
    if (options.solver == SolverKind::kRbf) {
        auto trained =
            train_rbf(pack.neutral_mm, pack.basis_mm, options.takes, options.noise_mm, options.rbf, progress);
        if (!trained) return failure(trained.error());
        pack.rbf = std::move(trained->model);
        pack.report.rbf = trained->report;
        pack.report.coverage =
            coverage_of_takes(pack.view().rbf, pack.neutral_mm, pack.basis_mm, options.takes);
    }
    if (is_regional(options.solver)) {
        auto regions = train_regions(options.solver, layout, pack.neutral_mm, pack.basis_mm, options.takes,
                                     options.regional);
        if (!regions) return failure(regions.error());
        pack.regions = std::move(*regions);
    }
    return pack;
}

}  // namespace rig::host
