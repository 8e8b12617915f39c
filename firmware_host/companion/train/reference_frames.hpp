// Which frames of a performance an example-based solver learns from [Chuang02 section 4.2].
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace rig::host {

struct FrameClusters {
    Eigen::MatrixXd centres;          // [k x d], the members' means
    std::vector<Eigen::Index> owner;  // of every row of the points
};

// k-means (Lloyd) from a start of maximum spread: the row farthest from the mean, then always the row
// farthest from those already taken. Deterministic; fewer than `count` clusters when rows repeat, at least
// one.
[[nodiscard]] FrameClusters cluster_frames(const Eigen::MatrixXd& points, std::size_t count);

// points: one frame a row, in principal components (mm). The frames nearest to the centres of a k-means
// clustering of every so many of them. Deterministic; rising indices, each once; fewer than `count` when
// clusters share a frame or points repeat. At least one for a take with frames.
[[nodiscard]] std::vector<Eigen::Index> choose_reference_frames(const Eigen::MatrixXd& points,
                                                                std::size_t count);

}  // namespace rig::host
