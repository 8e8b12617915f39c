// Chuang02 section 4.1 and Figs. 4-5: weights of plain least squares have large positive and negative values
// that cancel on the source's shapes and not on the target's; non-negative ones carry over.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "firmware_host/companion/experiments/experiment.hpp"
#include "firmware_host/companion/experiments/performance.hpp"
#include "firmware_host/companion/train/key_shapes.hpp"
#include "firmware_host/companion/train/white_noise.hpp"

namespace rig::host {

namespace {

using Eigen::MatrixXd;

constexpr std::array<std::size_t, 2> kImageAxes{0, 1};
constexpr std::size_t kShapes = 20;
constexpr double kTracing_mm = 1.0;  // of each coordinate of a shape that was traced by hand
constexpr std::uint64_t kTracings = 8;

// Rms distance of a marker in the image plane, from coordinates.
double marker_rms_mm(const MatrixXd& error_mm) {
    return std::sqrt(2.0 * error_mm.squaredNorm() / static_cast<double>(error_mm.size()));
}

struct Retargeted {
    double source_mm = 0.0;
    double target_mm = 0.0;  // rms over the tracings
    double largest_weight = 0.0;
};

// The target's shapes are the source's as a person traced them, so the true target motion is the source's.
Retargeted retarget(const MatrixXd& positions_mm, const MatrixXd& shapes_mm, const MatrixXd& weights) {
    Retargeted out{marker_rms_mm(weights * shapes_mm - positions_mm), 0.0, weights.cwiseAbs().maxCoeff()};
    for (std::uint64_t tracing = 0; tracing < kTracings; ++tracing) {
        WhiteNoise noise(500 + tracing);
        MatrixXd traced = shapes_mm;
        for (double& x : traced.reshaped()) x += kTracing_mm * noise.next();
        const double error = marker_rms_mm(weights * traced - positions_mm);
        out.target_mm += error * error / static_cast<double>(kTracings);
    }
    out.target_mm = std::sqrt(out.target_mm);
    return out;
}

std::vector<std::string> row_of(const std::string& name, const char* solver, const Retargeted& r) {
    return {name, solver, fmt::format("{:.3f}", r.source_mm), fmt::format("{:.3f}", r.target_mm),
            fmt::format("{:.2f}", r.largest_weight)};
}

}  // namespace

Result<ExperimentTable, FileError> chuang02_non_negative(const std::filesystem::path& data) {
    const auto head = load_recorded_head(data, "102");
    if (!head) return failure(head.error());
    ExperimentTable out;
    out.columns = {"region", "solver", "source, mm", "target, mm", "largest |w|"};
    std::vector<MarkerRegion> regions = feature_regions(head->layout);
    std::erase_if(regions, [](const MarkerRegion& region) { return region.name != "mouth"; });
    regions.push_back(lip_region(head->layout));
    for (const MarkerRegion& region : regions) {
        const RegionMotion motion = region_motion(region, head->model.neutral_mm, head->model.basis_mm,
                                                  std::span(&head->range_of_motion, 1), kImageAxes);
        const KeyShapes shapes = choose_key_shapes(motion, KeyShapeMethod::kSpread, kShapes);
        const Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver(shapes.positions_mm.transpose());
        const MatrixXd plain = solver.solve(motion.positions_mm.transpose()).transpose();
        double kkt = 0.0;
        const MatrixXd positive = key_shape_weights(motion.positions_mm, shapes.positions_mm, kkt);
        const Retargeted squares = retarget(motion.positions_mm, shapes.positions_mm, plain);
        const Retargeted nnls = retarget(motion.positions_mm, shapes.positions_mm, positive);
        out.rows.push_back(row_of(region.name, "least squares", squares));
        out.rows.push_back(row_of(region.name, "non-negative", nnls));
        out.bounds.push_back({region.name + ": target error, non-negative against least squares",
                              nnls.target_mm / squares.target_mm, 0.5});
        out.bounds.push_back({region.name + ": largest weight, non-negative", nnls.largest_weight, 1.2});
    }
    out.remarks = {
        fmt::format("{} key shapes by maximum spread, range-of-motion take, image plane; rms distance of a "
                    "marker. The target's shapes are the source's with {} mm of tracing noise, rms over {} "
                    "tracings.",
                    kShapes, kTracing_mm, kTracings),
        "The truth is exactly linear in the shapes, which flatters least squares on the source."};
    return out;
}

}  // namespace rig::host
