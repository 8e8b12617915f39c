// Whole faces put together from regions, each the convex combination of its own examples that core finds.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "firmware_host/companion/experiments/performance.hpp"
#include "firmware_host/companion/train/face_regions.hpp"

namespace rig::host {

// Streamed weights [k x N] of a face's examples: the neutral one, then `count` - 1 frames of the take that
// are as different as can be. Fewer when the take repeats itself.
[[nodiscard]] Eigen::MatrixXd face_examples(const RecordedHead& head, const Take& take, std::size_t count);

struct RegionFit {
    double marker_rms_mm = 0.0;  // distance of every marker of every frame from where it was
    double worst_kkt = 0.0;      // of any region in any frame
    std::size_t uncertified = 0;
};

// Every frame of the take without noise. Markers that several regions share are blended as the regions say.
[[nodiscard]] RegionFit fit_regions(const RecordedHead& head, const std::vector<MarkerRegion>& plan,
                                    const Eigen::MatrixXd& examples, const Take& take);

}  // namespace rig::host
