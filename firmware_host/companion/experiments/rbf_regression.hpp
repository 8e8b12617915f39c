// An RBF trained on a take and evaluated by core, without a pack file in between.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/solve/rbf.hpp"
#include "firmware_host/companion/experiments/performance.hpp"
#include "firmware_host/companion/train/rbf_training.hpp"

namespace rig::host {

class RbfRegression {
  public:
    // Markers are those of `model`, with noise of noise_mm, as train_rbf() says.
    [[nodiscard]] static Result<RbfRegression, FileError> learn(const MarkerModel& model, const Take& take,
                                                                double noise_mm,
                                                                const RbfTrainingOptions& options);

    // t [3m]; the result [N] is valid until the next call.
    std::span<const float> evaluate(std::span<const float> t);
    [[nodiscard]] double distance_widths() const { return distance_widths_; }  // of the last evaluate()
    [[nodiscard]] const RbfTrainingReport& report() const { return report_; }

  private:
    RbfRegression() = default;

    std::unique_ptr<RbfTables> tables_ = std::make_unique<RbfTables>();
    std::unique_ptr<RbfWorkspace> workspace_ = std::make_unique<RbfWorkspace>();
    std::vector<float> weights_;
    double distance_widths_ = 0.0;
    RbfTrainingReport report_;
};

struct TakeScore {
    double weight_rms = 0.0;
    double distance_p50 = 0.0;  // to the nearest centre, in its widths
    double distance_p95 = 0.0;
};

// Over every `stride`-th frame of the take, markers of `model` with noise.
[[nodiscard]] TakeScore score(RbfRegression& rbf, const MarkerModel& model, const Take& take, double noise_mm,
                              std::size_t stride);

}  // namespace rig::host
