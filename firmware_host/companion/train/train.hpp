// From a head, a marker layout and, where there are some, performances to everything a pack holds.
// Not for reading or writing files.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/pack/solve_pack.hpp"
#include "firmware_host/companion/files/file_error.hpp"
#include "firmware_host/companion/rig_folder/rig_folder.hpp"
#include "firmware_host/companion/train/coverage.hpp"
#include "firmware_host/companion/train/marker_set_training.hpp"
#include "firmware_host/companion/train/rbf_training.hpp"
#include "firmware_host/companion/train/regional_training.hpp"

namespace rig::host {

// The pull towards the previous solution, gamma = noise^2 / step^2 (methods.md 3.7).
struct TemporalPull {
    // kSolversOwn: on for the box QP, off for the others, which are the sources' own and know no previous
    // frame.
    enum class Mode { kSolversOwn, kOff, kOn };
    Mode mode = Mode::kSolversOwn;
    std::optional<double>
        step;  // expected change of every weight from frame to frame, instead of the takes' or default
};

struct TrainOptions {
    SolverKind solver = SolverKind::kBoxQp;
    std::vector<Take> takes;  // shapes of the rig
    std::vector<CameraModel> cameras;
    std::vector<HelmetMark> reference_marks;  // at most kMaxReferenceMarks
    double rate_hz = 60.0;
    double noise_mm = 0.1;
    TemporalPull temporal;
    // Relative to the summed squared noise of all marker coordinates, 3 m noise^2 [Hybrid16 section 3].
    // Without a value: the box QP's default for the box QP, 0 for the others.
    std::optional<double> sparsity;
    std::optional<double> ridge;
    RbfTrainingOptions rbf;
    RegionalTrainingOptions regional;
    bool marker_sets = true;  // how unseen markers move with seen ones; false: a pack for older rigs
};

inline constexpr double kDefaultSparsity = 0.01;
inline constexpr double kDefaultRidge = 0.01;

// A shape that moves the layout's markers by less than this in sum (Euclidean norm of its column) is
// invisible to it.
inline constexpr double kInvisibleMm = 0.5;

struct InvisibleShape {
    std::string name;
    double column_mm = 0.0;
};

struct TrainReport {
    std::size_t rank = 0;    // of B; the box QP wants it to be the number of shapes [Hybrid16]
    double condition = 0.0;  // largest over smallest singular value that counts towards the rank
    std::vector<InvisibleShape> invisible;
    std::optional<RbfTrainingReport> rbf;
    std::optional<Coverage> coverage;  // of the takes by the RBF's references
};

// Owns the numbers of a pack. Moving keeps views valid; copying is not allowed.
class TrainedPack {
  public:
    TrainedPack() = default;
    TrainedPack(TrainedPack&&) = default;
    TrainedPack& operator=(TrainedPack&&) = default;

    // Points into this object.
    [[nodiscard]] SolvePack view() const;

    SolverKind solver = SolverKind::kBoxQp;
    double rate_hz = 60.0;
    double noise_mm = 0.1;
    double sparsity_mm2 = 0.0;
    double ridge_mm2 = 0.0;
    std::vector<std::string> shape_names, marker_names;
    std::vector<float> neutral_mm, basis_mm, weight_low, weight_high, prior_mean, prior_sigma, temporal_gamma;
    std::vector<CameraModel> cameras;
    std::vector<HelmetMark> reference_marks;
    TrainedRbf rbf;
    std::vector<TrainedRegion> regions;
    std::vector<TrainedMarkerSet> marker_sets;
    TrainReport report;
};

// What is wrong with the options for so many takes, with the remedy; empty when nothing is.
[[nodiscard]] std::string fault_of_options(const TrainOptions& options, std::size_t take_count);

// Errors: counts outside core's limits, options out of range, an RBF or regions without a take.
// Deterministic.
[[nodiscard]] Result<TrainedPack, FileError> train(const Rig& rig, const MarkerLayout& layout,
                                                   const TrainOptions& options,
                                                   const TrainingProgress& progress = {});

}  // namespace rig::host
