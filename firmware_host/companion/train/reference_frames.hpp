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

// k-means (Lloyd) from centres at these rows of the points. Deterministic; at most 30 rounds.
[[nodiscard]] FrameClusters cluster_frames(const Eigen::MatrixXd& points,
                                           const std::vector<Eigen::Index>& starts);

// points: one frame a row, in principal components (mm). The frames nearest to the centres of a k-means
// clustering (Lloyd) that starts from maximum spread: the frame farthest from the mean, then always the frame
// farthest from those already taken. Deterministic; rising indices, each once; fewer than `count` when
// clusters share a frame or points repeat. At least one for a take with frames.
[[nodiscard]] std::vector<Eigen::Index> choose_reference_frames(const Eigen::MatrixXd& points,
                                                                std::size_t count);

}  // namespace rig::host
