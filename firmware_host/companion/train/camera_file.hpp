// cameras.json: the calibrated cameras of a helmet, as `headrig world` and calibration write them.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/camera_model.hpp"
#include "core/geometry/mount_drift.hpp"
#include "firmware_host/companion/files/file_error.hpp"

namespace rig::host {

// Takes the top-level array "cameras" when there is one; otherwise, of "images", the first image of each
// camera letter. An entry has "R" (3x3, X_cam = R (X_head - centre), x right, y down, z forward) and
// "centre_mm"; its "width", "height", "f_px" (or "fx_px", "fy_px"), "cx", "cy", "k1", "k2" and, when not 0,
// "p1", "p2", "k3" to "k6" and "row_time_us" may stand at the top level instead, as may "lens": "rational"
// (when absent) or "fisheye", as core/geometry/camera_model.hpp defines them. At most kMaxCameras, each
// plausible by core's own rule. Errors name the file and the camera.
[[nodiscard]] Result<std::vector<CameraModel>, FileError> load_cameras(const std::filesystem::path& path);

// The same from text; `name` stands for the file in errors.
[[nodiscard]] Result<std::vector<CameraModel>, FileError> parse_cameras(std::string_view text,
                                                                        const std::filesystem::path& name);

// The top-level array "reference_marks" of a camera file, dots fixed to the helmet: "headset_mm" (3 numbers)
// and, when not every camera can see the dot, "cameras", the letters of those that do. Empty when there is
// none. At most kMaxReferenceMarks. Errors name the file and the mark.
[[nodiscard]] Result<std::vector<HelmetMark>, FileError> load_reference_marks(
    const std::filesystem::path& path);

// The same from text; `name` stands for the file in errors.
[[nodiscard]] Result<std::vector<HelmetMark>, FileError> parse_reference_marks(
    std::string_view text, const std::filesystem::path& name);

// The members of an entry that describe the camera itself, in the file's order.
[[nodiscard]] nlohmann::ordered_json camera_json(const CameraModel& camera);

[[nodiscard]] const char* lens_name(LensModel lens);

// What calibration knows of one camera.
struct CameraEntry {
    std::string name;
    CameraModel model;
    double rms_px = 0.0;          // distance of seen from projected points
    std::size_t view_count = 0;   // pictures behind it
    std::size_t point_count = 0;  // points in them
};

// Writes a cameras.json that load_cameras() and load_reference_marks() read, 17 digits each. `note` says
// where it comes from. Marks: cameras by their place in `cameras`.
[[nodiscard]] Result<void, FileError> save_cameras(const std::filesystem::path& path,
                                                   std::span<const CameraEntry> cameras,
                                                   const std::string& note,
                                                   std::span<const HelmetMark> marks = {});

}  // namespace rig::host
