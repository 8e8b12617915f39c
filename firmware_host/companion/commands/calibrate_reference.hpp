// What `headrig calibrate cameras` keeps of the rig as it was: its headset frame, and the marks on the
// helmet, which are given in that frame.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/geometry/camera_model.hpp"
#include "core/geometry/mount_drift.hpp"
#include "firmware_host/companion/files/file_error.hpp"

namespace rig::host {

struct RigReference {
    std::vector<CameraModel> cameras;
    std::vector<HelmetMark> marks;
};

// Of a cameras.json, or of a pack: whatever does not begin like JSON is opened as one. Errors: unreadable,
// or a pack without cameras.
[[nodiscard]] Result<RigReference, FileError> load_rig_reference(const std::filesystem::path& path);

// Empty, or why writing `out` without a reference would lose marks that it holds, and how to keep them.
[[nodiscard]] std::string marks_at_stake(const std::filesystem::path& out);

}  // namespace rig::host
