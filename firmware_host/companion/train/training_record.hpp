// What training saw on its way to an RBF, in a file of its own beside the pack: the board has no use for it.
//
// A table with the columns pack,curve,series,x,y; every row names the pack it belongs to by its UUID.
//
//   curve             series             x                     y
//   figure            name               0                     value
//   coverage          name               0 or quantile 0..1    value
//   variance          share              component, from 1     share of the variance, 0..1
//   cross_validation  components         width, in spacings    weight rms on the blocks left out
//   gcv               shape              lambda                GCV, one row an iteration
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/pack/manifest.hpp"
#include "firmware_host/companion/files/file_error.hpp"
#include "firmware_host/companion/train/coverage.hpp"
#include "firmware_host/companion/train/rbf_training.hpp"

namespace rig::host {

struct TrainingRecord {
    std::string pack_uuid;  // 32 hexadecimal digits
    RbfTrainingReport rbf;
    Coverage coverage;
    std::vector<std::string> shape_names;  // of rbf.gcv_paths
};

[[nodiscard]] std::string uuid_text(const PackManifest& manifest);

// face.pack -> face.training.csv, in the same folder.
[[nodiscard]] std::filesystem::path training_record_path(const std::filesystem::path& pack);

// Values that are not finite are left out.
[[nodiscard]] std::string training_record_text(const TrainingRecord& record);
// `name` stands for the file in errors. Errors: another table, an unknown curve or figure, rows of two packs,
// no rows.
[[nodiscard]] Result<TrainingRecord, FileError> parse_training_record(std::string_view text,
                                                                      const std::filesystem::path& name);

}  // namespace rig::host
