#include "firmware_host/companion/sample/sample.hpp"

namespace rig::host {

Result<void, FileError> save_sample(const std::filesystem::path& folder) {
    const Rig rig = sample_rig();
    if (const auto ok = save_rig(folder, rig); !ok) return ok;
    if (const auto ok = save_layout(folder, sample_layout(rig), rig); !ok) return ok;
    return save_take(folder / "take.csv", sample_take(rig));
}

}  // namespace rig::host
