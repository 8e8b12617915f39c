// What detection found, drawn over its image: `headrig detect --overlay`.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/detect/observation.hpp"
#include "firmware_host/companion/files/file_error.hpp"
#include "firmware_host/companion/files/image_file.hpp"

namespace rig::host {

// Half axes of a blob as an ellipse with its second moments has them; the angle of the major one, from +x
// towards +y (down), in (-pi/2, pi/2].
struct BlobEllipse {
    double major_px = 0.0;
    double minor_px = 0.0;
    double angle_rad = 0.0;
};

// Measured in the image around an observation, against the brightness of the skin around it. Where nothing
// can be measured (a flat image, the image's edge) a circle of the observation's diameter.
[[nodiscard]] BlobEllipse measure_ellipse(const GreyImage& image, const Observation& seen);

// Where each image's overlay goes, in the images' order. `wanted` is a PNG for one image; for several a
// folder, which is made, or NAME.png, which becomes NAME_<image>.png. One image into a folder is fine too.
// Errors: neither a .png nor a folder, two images of the same name, an overlay that would replace an image
// that is read.
[[nodiscard]] Result<std::vector<std::filesystem::path>, FileError> overlay_paths(
    const std::filesystem::path& wanted, const std::vector<std::filesystem::path>& images);

// Twice the image's size (once, beyond 1280 px): every observation with the outline of its ellipse, coloured
// by its score from red (0) to green (1), a cross at its centre and its number, counted from 0 in the order
// of the CSV.
[[nodiscard]] Result<void, FileError> draw_detections(const std::filesystem::path& path,
                                                      const GreyImage& image,
                                                      std::span<const Observation> observations);

}  // namespace rig::host
