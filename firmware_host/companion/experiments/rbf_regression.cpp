#include "firmware_host/companion/experiments/rbf_regression.hpp"

namespace rig::host {

Result<RbfRegression, FileError> RbfRegression::learn(const MarkerModel& model, const Take& take,
                                                      double noise_mm, const RbfTrainingOptions& options) {
    const auto trained =
        train_rbf(model.neutral_mm, model.basis_mm, std::span(&take, 1), noise_mm, options, {});
    if (!trained) return failure(trained.error());
    const std::size_t n = take.shape_names.size();
    const std::vector<float> low(n, 0.0F);
    const std::vector<float> high(n, 1.0F);
    SolvePack pack;
    pack.solver = SolverKind::kRbf;
    pack.marker_count = static_cast<std::uint16_t>(model.neutral_mm.size() / 3);
    pack.shape_count = static_cast<std::uint16_t>(n);
    pack.weight_low = low;
    pack.weight_high = high;
    pack.rbf = view_of(trained->model);
    RbfRegression out;
    build_rbf_tables(pack, *out.tables_);
    out.weights_.resize(n);
    out.report_ = trained->report;
    return out;
}

std::span<const float> RbfRegression::evaluate(std::span<const float> t) {
    distance_widths_ = static_cast<double>(evaluate_rbf(*tables_, t, *workspace_, weights_).nearest_widths);
    return weights_;
}

TakeScore score(RbfRegression& rbf, const MarkerModel& model, const Take& take, double noise_mm,
                std::size_t stride) {
    WeightError error(model);
    std::vector<double> distances;
    for (std::size_t f = 0; f < take.frame_count; f += stride) {
        error.add(rbf.evaluate(marker_frame(model, take, f, noise_mm, 71)), frame_weights(take, f));
        distances.push_back(rbf.distance_widths());
    }
    return {error.rms(), quantile(distances, 0.5), quantile(distances, 0.95)};
}

}  // namespace rig::host
