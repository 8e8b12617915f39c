// The cameras of a helmet as the world sees through them, and cameras.json. Not core's camera model: a second
// implementation of the same published formula, on purpose.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "firmware_host/companion/files/npy.hpp"
#include "firmware_host/companion/world/vector.hpp"

namespace rig::host {

// X_cam = R (X_headset - centre), camera axes x right, y down, z forward; p = (X, Y) / Z, r2 = |p|^2,
// p_d = p (1 + k1 r2 + k2 r2^2), px = f p_d + c; integer px = pixel centre, origin top-left.
struct HelmetCamera {
    std::string name;  // "a", "b", ...
    int width_px = 480;
    int height_px = 640;
    double f_px = 600.0;
    double cx_px = 239.5;
    double cy_px = 319.5;
    double k1 = 0.0;
    double k2 = 0.0;
    Mat3d rotation = kIdentity3;
    Vec3d centre_mm{};
};

struct PixelAt {
    double x_px = 0.0;
    double y_px = 0.0;
    double depth_mm = 0.0;  // along the optical axis; <= 0 is behind the camera and x_px, y_px mean nothing
};

[[nodiscard]] PixelAt see(const HelmetCamera& camera, const Vec3d& headset_mm);

// Undistorted (X/Z, Y/Z) of a pixel. NaN where the distortion formula does not reach, i.e. beyond the radius
// at which it folds back.
struct RaySlope {
    double x = 0.0;
    double y = 0.0;
};
[[nodiscard]] RaySlope slope_of_pixel(const HelmetCamera& camera, double x_px, double y_px);

// 1: one camera straight ahead; 2: left and right, baseline 90 mm; 3: and one below; 4: and one above. All
// are 480x640 (the sensor stands upright), about 200 mm from the cheeks, each with its own lens, aimed
// between nose and lips.
[[nodiscard]] std::vector<HelmetCamera> default_helmet(std::size_t camera_count);

// The "cameras" array of a cameras.json. Refuses: not JSON, no such array, more than kMaxCameras, sizes of
// cameras that differ, numbers that are absent, not finite or out of range, R that is no rotation.
[[nodiscard]] Result<std::vector<HelmetCamera>, FileError> load_helmet(const std::filesystem::path& path);

// cameras.json without images: what training and the daemon may know about the helmet.
[[nodiscard]] Result<void, FileError> save_helmet(const std::filesystem::path& path,
                                                  const std::vector<HelmetCamera>& cameras,
                                                  double dot_radius_mm, const std::string& layout);

// One entry of the "images" array. `rotation` and `centre_mm` are the camera in the frame of the head itself,
// slip included: X_cam = R (X_head - centre).
struct ImageRecord {
    std::string image;
    std::size_t frame = 0;
    std::size_t camera = 0;
    std::string style;
    Mat3d rotation = kIdentity3;
    Vec3d centre_mm{};
};
[[nodiscard]] Result<void, FileError> save_helmet(const std::filesystem::path& path,
                                                  const std::vector<HelmetCamera>& cameras,
                                                  double dot_radius_mm, const std::string& layout,
                                                  const std::vector<ImageRecord>& images);

}  // namespace rig::host
