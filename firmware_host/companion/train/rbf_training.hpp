// Trains the RBF regression of core/solve/rbf.hpp on a performance [Deng06 sections 4-5]: PCA on all frames,
// reference frames out of the performance, ridge by generalised cross-validation; dimensions and widths by
// cross-validation (ours).
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/limits.hpp"
#include "core/pack/solve_pack.hpp"
#include "firmware_host/companion/files/file_error.hpp"
#include "firmware_host/companion/rig_folder/rig_folder.hpp"
#include "firmware_host/companion/train/gcv.hpp"

namespace rig::host {

// Called with 0..1 from time to time.
using TrainingProgress = std::function<void(double)>;

struct RbfTrainingOptions {
    std::size_t centres = 100;   // reference frames wanted, 2..kMaxRbfCentres; the source used 100
    std::size_t dimensions = 0;  // components kept; 0: by cross-validation up to kMaxRbfDimensions
    // No kernel gets a polynomial part: the ridge makes the problem well posed for the conditionally definite
    // ones too, and the offset is the constant. README.md says what a linear part would cost.
    RbfKernel kernel = RbfKernel::kGaussian;
    // The pack's fallback to the box QP, 0 <= near < far <= 1000 widths; both 0: none.
    double hull_near_widths = 0.0;
    double hull_far_widths = 0.0;
};

// One fit that cross-validation judged.
struct CrossValidation {
    std::size_t dimensions = 0;
    double width_factor = 0.0;
    double weight_rms = 0.0;  // on blocks of the take whose references were left out
};

struct RbfTrainingReport {
    std::size_t frames = 0;
    std::size_t dimensions = 0;
    std::size_t centres = 0;
    double variance_kept = 0.0;        // share of the markers' variance in the components, 0..1
    double width_factor = 0.0;         // of the local spacing
    double median_lambda = 0.0;        // ridge
    double cross_validated_rms = 0.0;  // of all weights, on blocks of the take whose references were left out
    double in_take_rms = 0.0;          // of all weights, on all frames of the take, with marker noise
    double visible_in_take_rms = 0.0;  // the same over shapes whose marker column is longer than 1 mm
    // From the frames of the take, with marker noise, to their nearest references, in widths: what is usual,
    // and what a fallback should begin beyond.
    double distance_p50 = 0.0;
    double distance_p95 = 0.0;
    std::vector<CrossValidation> cross_validation;  // in the order tried
    std::vector<GcvPath> gcv_paths;                 // of the final model, one for each shape
    std::vector<double> variance_shares;            // of each component worth keeping, falling; sum <= 1
};

struct TrainedRbf {
    RbfKernel kernel = RbfKernel::kGaussian;
    float hull_near_widths = 0.0F;
    float hull_far_widths = 0.0F;
    std::uint16_t dimension_count = 0;
    std::uint16_t centre_count = 0;
    std::vector<float> mean_mm, basis, centres, widths_mm, weights, offset;
};

// Points into `trained`.
[[nodiscard]] RbfModel view_of(const TrainedRbf& trained);

struct RbfTraining {
    TrainedRbf model;
    RbfTrainingReport report;
};

// neutral_mm [3m], basis_mm [3m x N]; every take has N weights a frame. Frames are the model's markers plus
// white noise of noise_mm, as the rig will see them. Errors: fewer frames than twice the references and a
// block need, no motion.
[[nodiscard]] Result<RbfTraining, FileError> train_rbf(std::span<const float> neutral_mm,
                                                       std::span<const float> basis_mm,
                                                       std::span<const Take> takes, double noise_mm,
                                                       const RbfTrainingOptions& options,
                                                       const TrainingProgress& progress);

}  // namespace rig::host
