// The page of `headrig report` and `headrig train --report`.
//
// A pack holds no training curves: they are written at training time, when they exist; a page made from the
// pack alone says what can be had from it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/pack/solve_pack.hpp"
#include "firmware_host/companion/report/pack_analysis.hpp"
#include "firmware_host/companion/report/svg_chart.hpp"
#include "firmware_host/companion/train/train.hpp"

namespace rig::host {

// A curve that training followed, with what it chose: cross-validation against width or dimensions, GCV
// against lambda.
struct TrainingCurve {
    std::string title;
    LineChart chart;
};

struct PackPageInput {
    std::string name;
    const SolvePack& pack;
    const PackAnalysis& analysis;
    std::optional<RbfTrainingReport> rbf;  // at training time
    std::optional<Coverage> coverage;      // ... of the training takes
    std::vector<TrainingCurve> curves;     // ... of an RBF
};

// HTML; every text from the pack is escaped.
[[nodiscard]] std::string pack_page(const PackPageInput& input);

}  // namespace rig::host
