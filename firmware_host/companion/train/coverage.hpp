// How well the chosen reference frames cover a performance (future work in [Deng06]): the distance from every
// frame to its nearest reference, in that reference's own width, which is what core's
// RbfReport::nearest_widths says at run time.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>

#include "firmware_host/companion/rig_folder/rig_folder.hpp"
#include "firmware_host/companion/train/rbf_training.hpp"

namespace rig::host {

inline constexpr std::array kCoverageQuantiles{0.5, 0.9, 0.99, 1.0};

struct Coverage {
    std::size_t frames = 0;
    double covered_share = 0.0;  // of the frames within one width of a reference, 0..1
    double lost_share = 0.0;     // ... beyond three, where every height is under 0.011
    std::array<double, kCoverageQuantiles.size()> widths{};       // quantiles of the distance, in widths
    std::array<double, kCoverageQuantiles.size()> distance_mm{};  // ... to the nearest reference, in mm
    double spread_mm =
        0.0;  // rms distance of the frames from their mean: what the distances are to be held to
};

// points [F x d], centres [K x d] in the same principal components, mm; widths [K] > 0, mm. Wide widths cover
// everything, so the distances in mm stand beside. No frames or no references: all zero.
[[nodiscard]] Coverage coverage_of(const Eigen::MatrixXd& points, const Eigen::MatrixXd& centres,
                                   const Eigen::VectorXd& widths);

// Of takes by a trained RBF: frames are the model's markers, neutral_mm [3m] + basis_mm [3m x N] w, without
// noise.
[[nodiscard]] Coverage coverage_of_takes(const RbfModel& rbf, std::span<const float> neutral_mm,
                                         std::span<const float> basis_mm, std::span<const Take> takes);

}  // namespace rig::host
