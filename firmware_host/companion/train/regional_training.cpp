#include "firmware_host/companion/train/regional_training.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/base/float_kernels.hpp"
#include "core/limits.hpp"

namespace rig::host {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::array<std::size_t, 3> kAllAxes{0, 1, 2};

// Absolute positions [R x k] of the region's markers at these weights.
MatrixXd example_positions(const MarkerRegion& region, std::span<const float> neutral_mm,
                           std::span<const float> basis_mm, const MatrixXd& weights) {
    const auto n = static_cast<std::size_t>(weights.cols());
    MatrixXd out(static_cast<Index>(3 * region.markers.size()), weights.rows());
    for (std::size_t a = 0; a < region.markers.size(); ++a) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::size_t from = 3U * region.markers[a] + axis;
            for (Index k = 0; k < weights.rows(); ++k) {
                double x = static_cast<double>(neutral_mm[from]);
                for (std::size_t i = 0; i < n; ++i)
                    x += static_cast<double>(basis_mm[from * n + i]) * weights(k, static_cast<Index>(i));
                out(static_cast<Index>(3 * a + axis), k) = x;
            }
        }
    }
    return out;
}

// What both solvers measure from: the neutral centroid for every marker, or the mean example [R].
VectorXd origin_of(const MarkerRegion& region, RegionSolver solver, std::span<const float> neutral_mm,
                   const MatrixXd& positions) {
    if (solver == RegionSolver::kSimplex) return positions.rowwise().mean();
    VectorXd origin = VectorXd::Zero(positions.rows());
    for (std::size_t axis = 0; axis < 3; ++axis) {
        double sum = 0.0;
        for (const std::uint16_t k : region.markers) sum += static_cast<double>(neutral_mm[3U * k + axis]);
        for (std::size_t a = 0; a < region.markers.size(); ++a) {
            origin[static_cast<Index>(3 * a + axis)] = sum / static_cast<double>(region.markers.size());
        }
    }
    return origin;
}

std::string fault_of_counts(const RegionalTrainingOptions& options) {
    if (options.key_shapes < 1 || options.key_shapes > kMaxRegionShapes)
        return fmt::format("a region has 1 to {} key shapes", kMaxRegionShapes);
    if (options.examples < 2 || options.examples > kMaxRegionShapes)
        return fmt::format("a region has 2 to {} examples", kMaxRegionShapes);
    return {};
}

}  // namespace

RegionModel TrainedRegion::view() const {
    RegionModel out;
    out.name = name;
    out.solver = solver;
    out.marker_count = static_cast<std::uint16_t>(markers.size());
    out.example_count = static_cast<std::uint16_t>(example_count);
    out.markers = markers;
    out.marker_blend = marker_blend;
    out.origin_mm = origin_mm;
    out.examples_mm = examples_mm;
    out.shapes = shapes;
    out.shape_blend = shape_blend;
    return out;
}

std::vector<Index> example_frames(const RegionMotion& face, std::size_t count) {
    return choose_key_shapes(face, KeyShapeMethod::kSpread, count).frames;
}

TrainedRegion region_of_examples(const MarkerRegion& region, RegionSolver solver,
                                 std::span<const float> neutral_mm, std::span<const float> basis_mm,
                                 const MatrixXd& example_weights) {
    const MatrixXd positions = example_positions(region, neutral_mm, basis_mm, example_weights);
    const VectorXd origin = origin_of(region, solver, neutral_mm, positions);
    const auto k = static_cast<std::size_t>(example_weights.rows());
    const auto rows = static_cast<std::size_t>(positions.rows());
    TrainedRegion out;
    out.name = region.name;
    out.solver = solver;
    out.example_count = k;
    out.markers = region.markers;
    for (const double blend : region.blend) out.marker_blend.push_back(static_cast<float>(blend));
    out.examples_mm.assign(rows * padded(k), 0.0F);
    for (std::size_t r = 0; r < rows; ++r) {
        const auto row = static_cast<Index>(r);
        out.origin_mm.push_back(static_cast<float>(origin[row]));
        for (std::size_t j = 0; j < k; ++j) {
            out.examples_mm[r * padded(k) + j] =
                static_cast<float>(positions(row, static_cast<Index>(j)) - origin[row]);
        }
    }
    for (Index j = 0; j < example_weights.rows(); ++j) {
        for (Index i = 0; i < example_weights.cols(); ++i)
            out.shapes.push_back(static_cast<float>(example_weights(j, i)));
    }
    return out;
}

Result<std::vector<TrainedRegion>, FileError> train_regions(SolverKind solver, const MarkerLayout& layout,
                                                            std::span<const float> neutral_mm,
                                                            std::span<const float> basis_mm,
                                                            std::span<const Take> takes,
                                                            const RegionalTrainingOptions& options) {
    if (const std::string fault = fault_of_counts(options); !fault.empty()) return failure(FileError{fault});
    std::size_t frames = 0;
    for (const Take& take : takes) frames += take.frame_count;
    if (frames < 2) return failure(FileError{"the takes have fewer than two frames to choose from"});
    const bool by_examples = solver == SolverKind::kExamples;
    const std::vector<MarkerRegion> plan = by_examples ? surface_regions(layout) : feature_regions(layout);
    if (plan.empty() || plan.size() > kMaxRegions)
        return failure(FileError{"the layout has no markers that a region could be made of"});
    const std::size_t n = basis_mm.size() / neutral_mm.size();
    const std::vector<double> shares = shape_shares(plan, basis_mm, n);

    std::vector<TrainedRegion> out;
    MatrixXd example_weights;
    std::vector<Index> example_indices;
    if (by_examples) {
        const RegionMotion face = region_motion(whole_face(layout)[0], neutral_mm, basis_mm, takes, kAllAxes);
        example_indices = example_frames(face, options.examples - 1);
        example_weights = MatrixXd::Zero(static_cast<Index>(example_indices.size()) + 1, face.weights.cols());
        for (std::size_t k = 0; k < example_indices.size(); ++k)
            example_weights.row(static_cast<Index>(k) + 1) = face.weights.row(example_indices[k]);
    }
    for (std::size_t r = 0; r < plan.size(); ++r) {
        if (by_examples) {
            out.push_back(
                region_of_examples(plan[r], RegionSolver::kSimplex, neutral_mm, basis_mm, example_weights));
            out.back().frames = example_indices;
        } else {
            const RegionMotion motion = region_motion(plan[r], neutral_mm, basis_mm, takes, kAllAxes);
            const KeyShapes shapes = choose_key_shapes(motion, options.method, options.key_shapes);
            out.push_back(region_of_examples(plan[r], RegionSolver::kNonNegative, neutral_mm, basis_mm,
                                             shapes.weights));
            out.back().frames = shapes.frames;
        }
        for (std::size_t i = 0; i < n; ++i)
            out.back().shape_blend.push_back(static_cast<float>(shares[r * n + i]));
    }
    return out;
}

}  // namespace rig::host
