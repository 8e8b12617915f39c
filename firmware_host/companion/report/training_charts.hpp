// A training's curves as charts: cross-validation against width and components, GCV against lambda, variance
// by component.
#pragma once

#include <string>
#include <vector>

#include "firmware_host/companion/report/svg_chart.hpp"
#include "firmware_host/companion/train/rbf_training.hpp"

namespace rig::host {

struct TrainingCurve {
    std::string title;  // what is drawn, what was chosen
    LineChart chart;
};

// Charts without a point are left out.
[[nodiscard]] std::vector<TrainingCurve> training_curves(const RbfTrainingReport& report);

}  // namespace rig::host
