// Deng06 section 8, future work: "to optimize the reduced dimensionality for this cross-mapping, e.g.,
// cross-validation".
#include <fmt/format.h>

#include "firmware_host/companion/experiments/experiment.hpp"
#include "firmware_host/companion/experiments/rbf_regression.hpp"

namespace rig::host {

namespace {

constexpr double kNoiseMm = 0.1;
constexpr std::size_t kStride = 8;

}  // namespace

Result<ExperimentTable, FileError> rbf_dimensions(const std::filesystem::path& data) {
    const auto head = load_recorded_head(data, "60");
    if (!head) return failure(head.error());
    ExperimentTable out;
    out.columns = {
        "d",          "variance",          "in take", "distance p50 / p95", "blocks left out (all shapes)",
        "other take", "distance p50 / p95"};
    for (std::size_t dimensions = 2; dimensions <= 20; ++dimensions) {
        auto rbf =
            RbfRegression::learn(head->model, head->range_of_motion, kNoiseMm, {.dimensions = dimensions});
        if (!rbf) return failure(rbf.error());
        const TakeScore same = score(*rbf, head->model, head->range_of_motion, kNoiseMm, kStride);
        const TakeScore other = score(*rbf, head->model, head->speech, kNoiseMm, kStride);
        out.rows.push_back({std::to_string(dimensions),
                            fmt::format("{:.2f} %", 100.0 * rbf->report().variance_kept),
                            fmt::format("{:.4f}", same.weight_rms),
                            fmt::format("{:.2f} / {:.2f}", same.distance_p50, same.distance_p95),
                            fmt::format("{:.4f}", rbf->report().cross_validated_rms),
                            fmt::format("{:.4f}", other.weight_rms),
                            fmt::format("{:.2f} / {:.2f}", other.distance_p50, other.distance_p95)});
    }
    out.remarks = {
        "Learned from the range-of-motion take (100 references, Gaussian), 60 markers, 0.1 mm noise; the "
        "other take is speech. Weight rms over shapes > 1 mm; distances to the nearest reference in its "
        "widths.",
        "The truth is exactly linear in the shapes, which flatters high dimensions."};
    return out;
}

}  // namespace rig::host
