// The built-in sample: a head, its marker layout and a performance, made by code alone. Same bytes on every
// machine. For trying and testing everything without data; not a model of any person.
#pragma once

#include <filesystem>

#include "firmware_host/companion/rig_folder/rig_folder.hpp"

namespace rig::host {

[[nodiscard]] Rig sample_rig();

// 60 markers on visible skin, left and right alike, outward normals.
[[nodiscard]] MarkerLayout sample_layout(const Rig& rig);

// 20 s at 60 Hz from the neutral face through every shape, then speech and mixed expressions; all weights in
// [0, 1].
[[nodiscard]] Take sample_take(const Rig& rig);

// The whole rig folder with take.csv. Replaces files that are there.
[[nodiscard]] Result<void, FileError> save_sample(const std::filesystem::path& folder);

}  // namespace rig::host
