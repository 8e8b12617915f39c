// How the markers of each set move together: principal components of a set's displacements over example
// expressions [Zhang06 section 10]. Not which markers make a set: marker_sets.hpp.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/limits.hpp"
#include "core/pack/solve_pack.hpp"
#include "firmware_host/companion/rig_folder/rig_folder.hpp"
#include "firmware_host/companion/train/marker_sets.hpp"

namespace rig::host {

// Mean and covariance of the weights of expressions; the markers' follow, since they are linear in them.
struct ExpressionSpread {
    Eigen::VectorXd mean;        // [N]
    Eigen::MatrixXd covariance;  // [N x N]
};

// Any face the rig can make: each shape on its own, with the default mean and spread of a weight.
[[nodiscard]] ExpressionSpread spread_of_rig(std::size_t shape_count);

// Of these expressions alone [K x N], K >= 1.
[[nodiscard]] ExpressionSpread spread_of_expressions(const Eigen::MatrixXd& weights);

// What a pack is trained with: a mixture of all frames of the takes and, for kRigShare, of any face the rig
// can make, so that what a take never showed is unlikely, not impossible. Without frames the rig alone.
[[nodiscard]] ExpressionSpread spread_of_takes(std::span<const Take> takes, std::size_t shape_count);

inline constexpr double kRigShare = 0.02;

struct MarkerSetOptions {
    std::size_t face_modes = kMaxModes;  // of the whole face, from which the device infers; 1..kMaxModes
    std::size_t set_modes = 10;          // of every other set; the source keeps 5 to 10
};

// Owns the numbers of one set; view() points into it.
struct TrainedMarkerSet {
    std::string name;
    std::uint8_t level = 0;
    std::size_t mode_count = 0;
    std::vector<std::uint16_t> markers;
    std::vector<float> mean_mm, modes, variance_mm2, residual_mm2;

    [[nodiscard]] MarkerSetModel view() const;
};

// One set of modes for each of `plan`: as many as the options say, fewer only where the expressions have no
// more rank. basis_mm: B [3m x N] row-major. A set whose markers never move keeps one mode of next to no
// variance. Deterministic.
[[nodiscard]] std::vector<TrainedMarkerSet> train_marker_sets(std::span<const MarkerSet> plan,
                                                              std::span<const float> basis_mm,
                                                              const ExpressionSpread& spread,
                                                              const MarkerSetOptions& options = {});

}  // namespace rig::host
