// The page of `headrig report` and `headrig train --report`.
//
// A pack holds no training curves: `headrig train` writes them beside it (train/training_record.hpp); without
// that file the page says what the pack alone tells.
#pragma once

#include <optional>
#include <string>

#include "core/pack/solve_pack.hpp"
#include "firmware_host/companion/report/pack_analysis.hpp"
#include "firmware_host/companion/train/train.hpp"
#include "firmware_host/companion/train/training_record.hpp"

namespace rig::host {

struct PackPageInput {
    std::string name;
    const SolvePack& pack;
    const PackAnalysis& analysis;
    std::optional<TrainingRecord> training;  // of this very pack
};

// HTML; every text from the pack is escaped.
[[nodiscard]] std::string pack_page(const PackPageInput& input);

}  // namespace rig::host
