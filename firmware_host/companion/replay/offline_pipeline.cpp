#include "firmware_host/companion/replay/offline_pipeline.hpp"

namespace rig::host {

Result<std::unique_ptr<Pipeline>, FileError> offline_pipeline(const SolvePack& pack,
                                                              const PipelineConfig& config,
                                                              const std::string& pack_name) {
    auto pipeline = std::make_unique<Pipeline>();
    if (!pipeline->configure(pack, config)) {
        return failure(
            FileError{pack_name + ": the solver refuses this pack; train it again with this version"});
    }
    return pipeline;
}

}  // namespace rig::host
