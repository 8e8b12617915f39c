// A pipeline for a host program that has a pack and no cameras.
#pragma once

#include <memory>
#include <string>

#include "core/pipeline/pipeline.hpp"
#include "firmware_host/companion/files/file_error.hpp"

namespace rig::host {

// Configured. Error: a pack that the solver refuses, by its name, with the remedy.
[[nodiscard]] Result<std::unique_ptr<Pipeline>, FileError> offline_pipeline(const SolvePack& pack,
                                                                            const PipelineConfig& config,
                                                                            const std::string& pack_name);

}  // namespace rig::host
