// A whole marker take through the stages that run on the board: stabilisation, inference, solve. Names are
// believed: no tracking, because a layout that is still misplaced would make it doubt them.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "core/pack/solve_pack.hpp"
#include "firmware_host/companion/fit/marker_take.hpp"

namespace rig::host {

struct SolvedTake {
    Eigen::MatrixXd weights;               // F x N
    std::vector<Rigid> headset_from_face;  // slip of each frame; identity without stabilisation
    std::vector<bool> solved;              // false: too few markers were seen; the frame counts for nothing
};

// The take has the pack's markers and is in the face frame up to slip. `progress` is called with 0..1.
[[nodiscard]] SolvedTake solve_take(const SolvePack& pack, const MarkerTake& take, bool stabilised,
                                    const std::function<void(double)>& progress = {});

}  // namespace rig::host
