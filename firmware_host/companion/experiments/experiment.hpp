// Results of the sources, measured again: one file an experiment, listed in registry.cpp. An experiment reads
// the shared data, prints nothing, and returns a table with the bounds it has to hold.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "firmware_host/companion/files/file_error.hpp"

namespace rig::host {

// `value` <= `most`, or the experiment failed.
struct ExperimentBound {
    std::string what;
    double value = 0.0;
    double most = 0.0;

    [[nodiscard]] bool holds() const { return value <= most; }  // NaN does not
};

struct ExperimentTable {
    std::vector<std::string> columns;
    std::vector<std::vector<std::string>> rows;  // as many cells as columns
    std::vector<ExperimentBound> bounds;         // none: the figures are reported, nothing is claimed
    std::vector<std::string> remarks;            // sentences that belong beside the figures
};

struct Experiment {
    std::string_view name;     // on the command line
    std::string_view repeats;  // the result of the source
    // `data`: the folder that holds rig/, takes/ and markers/. Deterministic.
    Result<ExperimentTable, FileError> (*run)(const std::filesystem::path& data);
};

// In alphabetical order.
[[nodiscard]] std::span<const Experiment> all_experiments();
// Null when there is none of that name.
[[nodiscard]] const Experiment* find_experiment(std::string_view name);
[[nodiscard]] bool all_bounds_hold(const ExperimentTable& table);

// The experiments, each in the file of its name.
[[nodiscard]] Result<ExperimentTable, FileError> chuang02_key_shapes(const std::filesystem::path& data);
[[nodiscard]] Result<ExperimentTable, FileError> chuang02_non_negative(const std::filesystem::path& data);
[[nodiscard]] Result<ExperimentTable, FileError> deng06_mistracked(const std::filesystem::path& data);
[[nodiscard]] Result<ExperimentTable, FileError> deng06_proportions(const std::filesystem::path& data);
[[nodiscard]] Result<ExperimentTable, FileError> deng06_variance(const std::filesystem::path& data);
[[nodiscard]] Result<ExperimentTable, FileError> hybrid16_barycentric(const std::filesystem::path& data);
[[nodiscard]] Result<ExperimentTable, FileError> identity_bootstrap(const std::filesystem::path& data);
[[nodiscard]] Result<ExperimentTable, FileError> identity_swaps(const std::filesystem::path& data);
[[nodiscard]] Result<ExperimentTable, FileError> identity_troubles(const std::filesystem::path& data);
[[nodiscard]] Result<ExperimentTable, FileError> identity_unlabelled(const std::filesystem::path& data);
// `data` may be "sample": the built-in head and its take.
[[nodiscard]] Result<ExperimentTable, FileError> missing_markers(const std::filesystem::path& data);
[[nodiscard]] Result<ExperimentTable, FileError> rbf_dimensions(const std::filesystem::path& data);
[[nodiscard]] Result<ExperimentTable, FileError> temporal_prior(const std::filesystem::path& data);
[[nodiscard]] Result<ExperimentTable, FileError> zhang06_motion_model(const std::filesystem::path& data);
[[nodiscard]] Result<ExperimentTable, FileError> zhang06_propagation(const std::filesystem::path& data);
[[nodiscard]] Result<ExperimentTable, FileError> zhang06_regions(const std::filesystem::path& data);

}  // namespace rig::host
