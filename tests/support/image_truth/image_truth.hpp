// The rendered faces of the shared data with the true centres of their markers.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "firmware_host/companion/files/file_error.hpp"
#include "firmware_host/companion/files/image_file.hpp"
#include "tests/support/dot_scene/match.hpp"

namespace rig::test {

struct TrueImage {
    std::string name;
    host::GreyImage image;
    std::vector<TrueDot> dots;  // visible ones; expected = seen at cos_view above 0.35
};

// `folder` holds truth.csv and the images it names. Reach: half a dot's diameter, 3 px.
[[nodiscard]] Result<std::vector<TrueImage>, host::FileError> read_true_images(
    const std::filesystem::path& folder);

}  // namespace rig::test
