// Fills the regions of a pack from performances: key shapes for each of a few features [Chuang02], or the
// same examples for many small regions [Zhang06].
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/pack/solve_pack.hpp"
#include "firmware_host/companion/files/file_error.hpp"
#include "firmware_host/companion/rig_folder/rig_folder.hpp"
#include "firmware_host/companion/train/face_regions.hpp"
#include "firmware_host/companion/train/key_shapes.hpp"

namespace rig::host {

struct RegionalTrainingOptions {
    KeyShapeMethod method = KeyShapeMethod::kSpread;
    std::size_t key_shapes = 12;  // of each region, 1..kMaxRegionShapes; the source used 8 to 14
    std::size_t examples = 12;    // of the whole face, the neutral one among them; the source used 10 to 15
};

// Owns the numbers of one region; view() points into it.
struct TrainedRegion {
    std::string name;
    RegionSolver solver = RegionSolver::kNonNegative;
    std::size_t example_count = 0;
    std::vector<std::uint16_t> markers;
    std::vector<float> marker_blend, origin_mm, examples_mm, shapes, shape_blend;
    std::vector<Eigen::Index> frames;  // of the takes, one after the other, that the examples are

    [[nodiscard]] RegionModel view() const;
};

// Frames of the whole face that are as different as can be: the neutral pose comes first and is not among
// them.
[[nodiscard]] std::vector<Eigen::Index> example_frames(const RegionMotion& face, std::size_t count);

// A region whose examples are these streamed weights [k x N] on the rig.
[[nodiscard]] TrainedRegion region_of_examples(const MarkerRegion& region, RegionSolver solver,
                                               std::span<const float> neutral_mm,
                                               std::span<const float> basis_mm,
                                               const Eigen::MatrixXd& example_weights);

// solver: kKeyShapes or kExamples. Errors: no frames, no region with a marker, options out of range.
[[nodiscard]] Result<std::vector<TrainedRegion>, FileError> train_regions(
    SolverKind solver, const MarkerLayout& layout, std::span<const float> neutral_mm,
    std::span<const float> basis_mm, std::span<const Take> takes, const RegionalTrainingOptions& options);

}  // namespace rig::host
