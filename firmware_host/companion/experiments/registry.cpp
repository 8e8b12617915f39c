#include <algorithm>
#include <array>

#include "firmware_host/companion/experiments/experiment.hpp"

namespace rig::host {

std::span<const Experiment> all_experiments() {
    static constexpr std::array kExperiments{
        Experiment{"chuang02-key-shapes", "Chuang02 Fig. 6: error against the number of key shapes",
                   chuang02_key_shapes},
        Experiment{"chuang02-non-negative", "Chuang02 Figs. 4-5: why weights are not negative",
                   chuang02_non_negative},
        Experiment{"deng06-mistracked", "Deng06 Fig. 7: two badly tracked markers", deng06_mistracked},
        Experiment{"deng06-proportions", "Deng06 Fig. 6: RBF against equation solving, other proportions",
                   deng06_proportions},
        Experiment{"deng06-variance", "Deng06 section 5: 90.21 % of the variance in four components",
                   deng06_variance},
        Experiment{"hybrid16-barycentric",
                   "Hybrid16 section 6: barycentric optimisation of markers placed roughly",
                   hybrid16_barycentric},
        Experiment{"identity-bootstrap", "Names from nothing at any pose within range, 1,000 random starts",
                   identity_bootstrap},
        Experiment{"identity-swaps",
                   "Swapped names, labelled and in the tracker's memory, and how soon repaired",
                   identity_swaps},
        Experiment{"identity-troubles", "Markers that come off or slide are flagged, and no others",
                   identity_troubles},
        Experiment{"identity-unlabelled", "Names of both takes' unlabelled streams, from the first frame on",
                   identity_unlabelled},
        Experiment{"missing-markers", "Zhang06 section 10: where unseen markers are inferred to be",
                   missing_markers},
        Experiment{"rbf-dimensions", "Deng06 section 8: how many components, in the take and across takes",
                   rbf_dimensions},
        Experiment{"temporal-prior",
                   "Methods 3.7: what the pull towards the previous solution costs and gives",
                   temporal_prior},
        Experiment{"zhang06-motion-model",
                   "Zhang06 section 12: similarity against affine map, head motion in the image",
                   zhang06_motion_model},
        Experiment{"zhang06-propagation", "Zhang06 Fig. 12: motion propagation from 17 points",
                   zhang06_propagation},
        Experiment{"zhang06-regions", "Zhang06 section 5.3: small regions against the whole face",
                   zhang06_regions},
    };
    return kExperiments;
}

const Experiment* find_experiment(std::string_view name) {
    const auto all = all_experiments();
    const auto found = std::ranges::find(all, name, &Experiment::name);
    return found == all.end() ? nullptr : &*found;
}

bool all_bounds_hold(const ExperimentTable& table) {
    return std::ranges::all_of(table.bounds, &ExperimentBound::holds);
}

}  // namespace rig::host
