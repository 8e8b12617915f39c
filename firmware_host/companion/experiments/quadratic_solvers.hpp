// The solvers that the RBF is compared with.
#pragma once

#include <Eigen/QR>
#include <memory>
#include <span>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "firmware_host/companion/experiments/performance.hpp"
#include "firmware_host/companion/train/train.hpp"

namespace rig::host {

// Unbounded least squares, in double [Deng06 eq. 7].
class EquationSolving {
  public:
    explicit EquationSolving(const MarkerModel& model);
    [[nodiscard]] std::vector<float> solve(std::span<const float> t) const;

  private:
    Eigen::VectorXd neutral_mm_;
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factor_;
};

[[nodiscard]] std::vector<float> clamped(std::vector<float> weights);  // into [0, 1]

// The box QP as the product runs it: labelled frames through the pipeline, one after the other, no smoothing
// after the solve.
class BoxQpPipeline {
  public:
    // Trained as `headrig train --solver boxqp` does, without a take unless `options` has one. `stabilise`:
    // with slip and bad markers taken out.
    [[nodiscard]] static Result<BoxQpPipeline, FileError> learn(const RecordedHead& head, bool stabilise,
                                                                const TrainOptions& options = {});
    // The next frame, 1/60 s after the last; t [3m]; the result [N] is valid until the next call.
    std::span<const float> solve(std::span<const float> t);
    void restart();

  private:
    BoxQpPipeline() = default;

    std::unique_ptr<TrainedPack> pack_;
    std::unique_ptr<Pipeline> pipeline_ = std::make_unique<Pipeline>();
    std::unique_ptr<FaceState> state_ = std::make_unique<FaceState>();
    std::unique_ptr<FrameReport> report_ = std::make_unique<FrameReport>();
    std::vector<Vec3> positions_mm_;
    std::int64_t frame_ = 0;
};

}  // namespace rig::host
