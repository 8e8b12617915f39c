#include "firmware_host/companion/experiments/quadratic_solvers.hpp"

#include <algorithm>

namespace rig::host {

namespace {

using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace

EquationSolving::EquationSolving(const MarkerModel& model) {
    const auto rows = static_cast<Eigen::Index>(model.neutral_mm.size());
    const auto n = static_cast<Eigen::Index>(model.basis_mm.size()) / rows;
    neutral_mm_ = Eigen::Map<const Eigen::VectorXf>(model.neutral_mm.data(), rows).cast<double>();
    const Eigen::MatrixXd basis = Eigen::Map<const FloatRows>(model.basis_mm.data(), rows, n).cast<double>();
    factor_.compute(basis);
}

std::vector<float> EquationSolving::solve(std::span<const float> t) const {
    const Eigen::VectorXd motion =
        Eigen::Map<const Eigen::VectorXf>(t.data(), static_cast<Eigen::Index>(t.size())).cast<double>() -
        neutral_mm_;
    const Eigen::VectorXf w = factor_.solve(motion).cast<float>();
    return {w.begin(), w.end()};
}

std::vector<float> clamped(std::vector<float> weights) {
    for (float& w : weights) w = std::clamp(w, 0.0F, 1.0F);
    return weights;
}

Result<BoxQpPipeline, FileError> BoxQpPipeline::learn(const RecordedHead& head, bool stabilise,
                                                      const TrainOptions& options) {
    auto trained = train(head.rig, head.layout, options);
    if (!trained) return failure(trained.error());
    BoxQpPipeline out;
    out.pack_ = std::make_unique<TrainedPack>(std::move(*trained));
    out.positions_mm_.resize(head.layout.markers.size());
    PipelineConfig config;
    config.filter = false;
    config.stabilise = stabilise;
    if (!out.pipeline_->configure(out.pack_->view(), config)) {
        return failure(FileError{"the solver refuses the trained pack"});
    }
    return out;
}

std::span<const float> BoxQpPipeline::solve(std::span<const float> t) {
    for (std::size_t k = 0; k < positions_mm_.size(); ++k) {
        positions_mm_[k] = Vec3(static_cast<double>(t[3 * k]), static_cast<double>(t[3 * k + 1]),
                                static_cast<double>(t[3 * k + 2]));
    }
    pipeline_->step(LabelledFrame{frame_++ * 1'000'000 / 60, positions_mm_}, *state_, *report_);
    return std::span(state_->weights).first(pack_->shape_names.size());
}

void BoxQpPipeline::restart() {
    pipeline_->reset_tracking();
    frame_ += 60;
}

}  // namespace rig::host
