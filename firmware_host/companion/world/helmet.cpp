#include "firmware_host/companion/world/helmet.hpp"

#include <fmt/format.h>

#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/limits.hpp"

namespace rig::host {

namespace {

using Json = nlohmann::ordered_json;

constexpr double kLongestFocal_px = 1e5;
constexpr double kRotationTolerance = 1e-6;

HelmetCamera aimed(const std::string& name, const Vec3d& centre_mm, const Vec3d& target_mm) {
    HelmetCamera camera;
    camera.name = name;
    camera.centre_mm = centre_mm;
    const Vec3d forward = normalised(target_mm - centre_mm);
    const Vec3d down = normalised(Vec3d{0, -1, 0} - dot(Vec3d{0, -1, 0}, forward) * forward);
    const Vec3d right = cross(down, forward);
    camera.rotation = {right[0], right[1],   right[2],   down[0],   down[1],
                       down[2],  forward[0], forward[1], forward[2]};
    return camera;
}

Json rows(const Mat3d& m) {
    return Json::array({{m[0], m[1], m[2]}, {m[3], m[4], m[5]}, {m[6], m[7], m[8]}});
}

Json lens(const HelmetCamera& camera) {
    return Json{{"width", camera.width_px}, {"height", camera.height_px}, {"f_px", camera.f_px},
                {"cx", camera.cx_px},       {"cy", camera.cy_px},         {"k1", camera.k1},
                {"k2", camera.k2}};
}

bool is_rotation(const Mat3d& m) {
    const Mat3d square = multiply(m, transposed(m));
    for (std::size_t i = 0; i < 9; ++i) {
        if (!(std::abs(square[i] - kIdentity3[i]) < kRotationTolerance)) return false;
    }
    return dot(cross({m[0], m[1], m[2]}, {m[3], m[4], m[5]}), {m[6], m[7], m[8]}) > 0.0;
}

// nlohmann's accessors throw on a wrong type or an absent key; load_helmet() turns that into its error.
// Empty when the entry's lens is one that the world draws.
std::string fault_of_lens(const Json& entry) {
    bool drawn =
        !entry.is_object() || (!entry.contains("fx_px") && entry.value("lens", "rational") == "rational");
    for (const char* key : {"p1", "p2", "k3", "k4", "k5", "k6"})
        drawn = drawn && (!entry.is_object() || entry.value(key, 0.0) == 0.0);
    return drawn ? std::string()
                 : "the simulated world draws lenses of one focal length \"f_px\" with k1 and k2 only; a "
                   "calibrated lens is for `headrig train --cameras`";
}

HelmetCamera parsed(const Json& entry) {
    HelmetCamera camera;
    camera.name = entry.at("camera").get<std::string>();
    camera.width_px = entry.at("width").get<int>();
    camera.height_px = entry.at("height").get<int>();
    camera.f_px = entry.at("f_px").get<double>();
    camera.cx_px = entry.at("cx").get<double>();
    camera.cy_px = entry.at("cy").get<double>();
    camera.k1 = entry.value("k1", 0.0);
    camera.k2 = entry.value("k2", 0.0);
    for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 3; ++column) {
            camera.rotation[3 * row + column] = entry.at("R").at(row).at(column).get<double>();
        }
        camera.centre_mm[row] = entry.at("centre_mm").at(row).get<double>();
    }
    return camera;
}

// Empty when the camera can be rendered.
std::string fault_of(const HelmetCamera& camera) {
    if (camera.width_px < 16 || camera.width_px > static_cast<int>(kMaxImageWidth) || camera.height_px < 16 ||
        camera.height_px > static_cast<int>(kMaxImageHeight)) {
        return fmt::format("size {}x{} is outside 16x16 to {}x{}", camera.width_px, camera.height_px,
                           kMaxImageWidth, kMaxImageHeight);
    }
    for (const double value : {camera.f_px, camera.cx_px, camera.cy_px, camera.k1, camera.k2,
                               camera.centre_mm[0], camera.centre_mm[1], camera.centre_mm[2]}) {
        if (!(std::abs(value) < kLongestFocal_px)) return "a number is not finite or absurdly large";
    }
    if (!(camera.f_px > 1.0)) return "f_px must be above 1";
    if (!is_rotation(camera.rotation)) return "R is not a rotation matrix";
    return {};
}

}  // namespace

PixelAt see(const HelmetCamera& camera, const Vec3d& headset_mm) {
    const Vec3d p = multiply(camera.rotation, headset_mm - camera.centre_mm);
    if (!(p[2] > 0.0)) return {0.0, 0.0, p[2]};
    const double x = p[0] / p[2];
    const double y = p[1] / p[2];
    const double r2 = x * x + y * y;
    const double stretch = 1.0 + camera.k1 * r2 + camera.k2 * r2 * r2;
    return {camera.f_px * x * stretch + camera.cx_px, camera.f_px * y * stretch + camera.cy_px, p[2]};
}

RaySlope slope_of_pixel(const HelmetCamera& camera, double x_px, double y_px) {
    const double xd = (x_px - camera.cx_px) / camera.f_px;
    const double yd = (y_px - camera.cy_px) / camera.f_px;
    const double target = std::sqrt(xd * xd + yd * yd);
    double r = target;
    for (int step = 0; step < 30; ++step) {
        const double r2 = r * r;
        const double slope = 1.0 + 3.0 * camera.k1 * r2 + 5.0 * camera.k2 * r2 * r2;
        constexpr double kUnreached = std::numeric_limits<double>::quiet_NaN();
        if (!(slope > 0.0) || !(r < 10.0)) return {kUnreached, kUnreached};
        const double next = r - (r * (1.0 + camera.k1 * r2 + camera.k2 * r2 * r2) - target) / slope;
        const bool settled = std::abs(next - r) < 1e-14;
        r = next;
        if (settled) break;
    }
    const double scale = target > 0.0 ? r / target : 1.0;
    return {xd * scale, yd * scale};
}

std::vector<HelmetCamera> default_helmet(std::size_t camera_count) {
    // Between nose and lips, so that an open jaw and the hairline both stay in the picture.
    const Vec3d target{0.0, -33.0, 20.0};
    std::vector<HelmetCamera> cameras;
    if (camera_count <= 1) {
        cameras = {aimed("a", {0.0, -48.0, 232.0}, target)};
    } else {
        cameras = {aimed("a", {-45.0, -48.0, 228.0}, target), aimed("b", {45.0, -48.0, 228.0}, target)};
        if (camera_count >= 3) cameras.push_back(aimed("c", {0.0, -100.0, 228.0}, target));
        if (camera_count >= 4) cameras.push_back(aimed("d", {0.0, 30.0, 228.0}, target));
    }
    // No two lenses are alike; the spread is that of the reference images' single lens.
    constexpr std::array<std::array<double, 5>, kMaxCameras> kLenses = {
        {{598.4, 242.7, 317.4, -0.110, 0.018},
         {601.7, 236.9, 321.8, -0.104, 0.015},
         {599.1, 240.8, 323.6, -0.113, 0.020},
         {602.6, 238.2, 316.1, -0.107, 0.017}}};
    for (std::size_t c = 0; c < cameras.size(); ++c) {
        const auto& [f, cx, cy, k1, k2] = kLenses[c];
        cameras[c].f_px = f;
        cameras[c].cx_px = cx;
        cameras[c].cy_px = cy;
        cameras[c].k1 = k1;
        cameras[c].k2 = k2;
    }
    return cameras;
}

Result<std::vector<HelmetCamera>, FileError> load_helmet(const std::filesystem::path& path) {
    std::ifstream file(path);
    if (!file) return failure(FileError{fmt::format("{}: cannot be opened", path.string())});
    std::vector<HelmetCamera> cameras;
    try {
        const Json document = Json::parse(file);
        if (!document.is_object() || !document.contains("cameras")) {
            return failure(FileError{
                fmt::format("{}: has no \"cameras\" array; `headrig world --calibration FILE` writes one",
                            path.string())});
        }
        for (const Json& entry : document.at("cameras")) {
            if (const std::string fault = fault_of_lens(entry); !fault.empty())
                return failure(FileError{fmt::format("{}: {}", path.string(), fault)});
            cameras.push_back(parsed(entry));
        }
    } catch (const Json::exception& error) {
        return failure(FileError{fmt::format("{}: {}", path.string(), error.what())});
    }
    if (cameras.empty() || cameras.size() > kMaxCameras) {
        return failure(FileError{
            fmt::format("{}: {} cameras; a helmet has 1 to {}", path.string(), cameras.size(), kMaxCameras)});
    }
    for (const HelmetCamera& camera : cameras) {
        if (const std::string fault = fault_of(camera); !fault.empty()) {
            return failure(
                FileError{fmt::format("{}: camera \"{}\": {}", path.string(), camera.name, fault)});
        }
        if (camera.width_px != cameras[0].width_px || camera.height_px != cameras[0].height_px) {
            return failure(FileError{fmt::format("{}: cameras differ in image size", path.string())});
        }
    }
    return cameras;
}

Result<void, FileError> save_helmet(const std::filesystem::path& path,
                                    const std::vector<HelmetCamera>& cameras, double dot_radius_mm,
                                    const std::string& layout) {
    return save_helmet(path, cameras, dot_radius_mm, layout, {});
}

Result<void, FileError> save_helmet(const std::filesystem::path& path,
                                    const std::vector<HelmetCamera>& cameras, double dot_radius_mm,
                                    const std::string& layout, const std::vector<ImageRecord>& images) {
    Json document = cameras.empty() ? Json::object() : lens(cameras[0]);
    document["model"] =
        "p=(X,Y)/Z in camera axes (x right, y down, z forward), r2=|p|^2, p_d=p(1+k1 r2+k2 r2^2), "
        "px=f*p_d+c; "
        "integer px = pixel centre, origin top-left";
    document["camera"] = "X_cam = R (X_head - centre); in \"cameras\" the head is where it is without slip";
    document["dot_radius_mm"] = dot_radius_mm;
    document["layout"] =
        layout.find_first_not_of("0123456789") == std::string::npos && !layout.empty() && layout.size() < 9
            ? Json(std::stoi(layout))
            : Json(layout);
    document["cameras"] = Json::array();
    for (const HelmetCamera& camera : cameras) {
        Json entry{{"camera", camera.name}};
        entry.update(lens(camera));
        entry["R"] = rows(camera.rotation);
        entry["centre_mm"] = camera.centre_mm;
        document["cameras"].push_back(entry);
    }
    document["images"] = Json::array();
    for (const ImageRecord& record : images) {
        Json entry{{"image", record.image},
                   {"frame", record.frame},
                   {"camera", cameras[record.camera].name},
                   {"style", record.style}};
        entry.update(lens(cameras[record.camera]));
        entry["R"] = rows(record.rotation);
        entry["centre_mm"] = record.centre_mm;
        document["images"].push_back(entry);
    }
    std::ofstream file(path, std::ios::trunc);
    file << document.dump(1) << '\n';
    file.close();
    if (!file) return failure(FileError{fmt::format("{}: cannot be written", path.string())});
    return {};
}

}  // namespace rig::host
