// Which picture files belong to which camera, and which were taken at the same moment.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "firmware_host/companion/files/file_error.hpp"

namespace rig::host {

struct Shot {
    std::size_t camera = 0;
    std::size_t moment = 0;
    std::filesystem::path file;
};

struct ShotList {
    std::vector<std::string> cameras;
    std::vector<Shot> shots;  // by camera, then by moment
};

// The .png, .pgm, .jpg and .jpeg files of a folder, sorted by name; perhaps none. Error: it cannot be opened.
[[nodiscard]] Result<std::vector<std::filesystem::path>, FileError> pictures_in(
    const std::filesystem::path& folder);

// One argument a camera: a folder (its .png, .pgm, .jpg and .jpeg files; the moment is the file's name
// without ending, the camera's name the folder's) or a pattern with one * in the file's name (the moment is
// what the * stands for, the camera's name what stands around it). Moments are the same when they are spelled
// the same. Errors: a folder or pattern without pictures, more cameras than a rig carries, two cameras of one
// name.
[[nodiscard]] Result<ShotList, FileError> find_shots(const std::vector<std::string>& arguments);

// All pictures in one folder, named MOMENT_CAMERA.png, as `headrig world --images` names them. Cameras in
// alphabetical order.
[[nodiscard]] Result<ShotList, FileError> find_shots_by_name(const std::filesystem::path& folder);

}  // namespace rig::host
