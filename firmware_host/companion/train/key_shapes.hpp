// Which shapes of a performance the others are combined from, by the three ways of [Chuang02 section 4.2],
// and how well they do: E = sum_i |Q_i - F(w, S)|^2 with the weights that core finds (eq. 5).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware_host/companion/rig_folder/rig_folder.hpp"
#include "firmware_host/companion/train/face_regions.hpp"

namespace rig::host {

enum class KeyShapeMethod {
    kSpread,  // frames with the largest and the smallest projection on each of the first k/2 principal axes
    kClusters2,  // centres of mass of k clusters in two principal components
    kClusters3,  // ... in three
    kHull,  // frames on the convex hull in two principal components: as many as there are, or thinned to k
};

// "spread", "clusters2", "clusters3", "hull"; "clusters" is clusters3.
[[nodiscard]] std::optional<KeyShapeMethod> key_shape_method(std::string_view name);
[[nodiscard]] std::string_view key_shape_method_name(KeyShapeMethod method);

// A performance as a region sees it. Rows are frames.
struct RegionMotion {
    Eigen::MatrixXd positions_mm;  // [F x R], about the centroid of the region's neutral markers
    Eigen::MatrixXd weights;       // [F x N]
};

// Motion of the region's markers over all frames of the takes, of the axes named: {0, 1, 2}, or {0, 1} for
// what a camera in front sees [Chuang02].
[[nodiscard]] RegionMotion region_motion(const MarkerRegion& region, std::span<const float> neutral_mm,
                                         std::span<const float> basis_mm, std::span<const Take> takes,
                                         std::span<const std::size_t> axes);

struct KeyShapes {
    Eigen::MatrixXd positions_mm;      // [k x R]
    Eigen::MatrixXd weights;           // [k x N] streamed weights of each
    std::vector<Eigen::Index> frames;  // [k]; of a cluster the frame nearest to its centre
};

// Deterministic. Fewer than `count` when the performance has no more different frames. Sets of kSpread for
// rising even counts are nested. count 1..kMaxRegionShapes; for kHull the most, 0: kMaxRegionShapes.
[[nodiscard]] KeyShapes choose_key_shapes(const RegionMotion& motion, KeyShapeMethod method,
                                          std::size_t count);

struct KeyShapeError {
    double sum_mm2 = 0.0;         // E
    double rms_mm = 0.0;          // sqrt(E / coordinates)
    double largest_weight = 0.0;  // of a key shape, over all frames
    double worst_kkt = 0.0;
};

// Every frame as a non-negative combination of the key shapes, by core/solve/nnls.hpp.
[[nodiscard]] KeyShapeError key_shape_error(const Eigen::MatrixXd& positions_mm, const KeyShapes& shapes);

// The weights of that: [F x k].
[[nodiscard]] Eigen::MatrixXd key_shape_weights(const Eigen::MatrixXd& positions_mm,
                                                const Eigen::MatrixXd& shapes_mm, double& worst_kkt);

}  // namespace rig::host
