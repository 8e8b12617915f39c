#include "firmware_host/companion/train/camera_file.hpp"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>

#include "core/limits.hpp"
#include "core/pack/open_pack.hpp"
#include "firmware_host/companion/files/whole_file.hpp"

namespace rig::host {

namespace {

using nlohmann::json;

constexpr std::size_t kMaxCameraFileBytes = std::size_t{16} << 20;

// Reads the numbers of one entry; the first thing missing is remembered in `fault`.
class EntryReader {
  public:
    EntryReader(const json& entry, const json& file) : entry_(entry), file_(file) {}

    double number(const char* key, std::optional<double> otherwise = std::nullopt) {
        for (const json* place : {&entry_, &file_}) {
            const auto found = place->find(key);
            if (found == place->end()) continue;
            if (found->is_number()) return found->get<double>();
            return missing(fmt::format("\"{}\" is not a number", key));
        }
        if (otherwise) return *otherwise;
        return missing(fmt::format("\"{}\" is missing", key));
    }
    LensModel lens() {
        for (const json* place : {&entry_, &file_}) {
            const auto found = place->find("lens");
            if (found == place->end()) continue;
            if (*found == "rational") return LensModel::kRational;
            if (*found == "fisheye") return LensModel::kFisheye;
            missing("\"lens\" is neither \"rational\" nor \"fisheye\"");
            return LensModel::kRational;
        }
        return LensModel::kRational;
    }
    int pixels(const char* key) {
        const double value = number(key);
        if (value >= 1.0 && value <= 1e6) return static_cast<int>(value);
        missing(fmt::format("\"{}\" is not a number of pixels", key));
        return 0;
    }
    double element(const char* key, std::size_t row, std::optional<std::size_t> column = std::nullopt) {
        const auto found = entry_.find(key);
        if (found == entry_.end()) return missing(fmt::format("\"{}\" is missing", key));
        const json* value = found->is_array() && row < found->size() ? &(*found)[row] : nullptr;
        if (value != nullptr && column) {
            value = value->is_array() && *column < value->size() ? &(*value)[*column] : nullptr;
        }
        if (value == nullptr || !value->is_number()) {
            return missing(fmt::format("\"{}\" is not {} numbers", key, column ? "3 x 3" : "3"));
        }
        return value->get<double>();
    }
    [[nodiscard]] const std::string& fault() const { return fault_; }

  private:
    double missing(std::string fault) {
        if (fault_.empty()) fault_ = std::move(fault);
        return 0.0;
    }

    const json& entry_;
    const json& file_;
    std::string fault_;
};

CameraModel read_camera(EntryReader& read, bool one_focal_length) {
    CameraModel camera;
    camera.width_px = read.pixels("width");
    camera.height_px = read.pixels("height");
    camera.fx_px = read.number(one_focal_length ? "f_px" : "fx_px");
    camera.fy_px = read.number(one_focal_length ? "f_px" : "fy_px");
    camera.cx_px = read.number("cx");
    camera.cy_px = read.number("cy");
    camera.k1 = read.number("k1", 0.0);
    camera.k2 = read.number("k2", 0.0);
    camera.k3 = read.number("k3", 0.0);
    camera.k4 = read.number("k4", 0.0);
    camera.k5 = read.number("k5", 0.0);
    camera.k6 = read.number("k6", 0.0);
    camera.p1 = read.number("p1", 0.0);
    camera.p2 = read.number("p2", 0.0);
    camera.lens = read.lens();
    camera.row_time_us = read.number("row_time_us", 0.0);
    for (std::size_t i = 0; i < 9; ++i) {
        camera.camera_from_headset(static_cast<int>(i) / 3, static_cast<int>(i) % 3) =
            read.element("R", i / 3, i % 3);
    }
    for (std::size_t i = 0; i < 3; ++i) camera.centre_mm[static_cast<int>(i)] = read.element("centre_mm", i);
    return camera;
}

std::string letter_of(const json& entry, std::size_t index) {
    const auto found = entry.find("camera");
    return found != entry.end() && found->is_string() ? found->get<std::string>()
                                                      : fmt::format("number {}", index + 1);
}

nlohmann::ordered_json entry_of(const CameraEntry& entry) {
    nlohmann::ordered_json out{{"camera", entry.name}};
    out.update(camera_json(entry.model));
    out["rms_px"] = entry.rms_px;
    out["views"] = entry.view_count;
    out["points"] = entry.point_count;
    return out;
}

nlohmann::ordered_json mark_json(const HelmetMark& mark, std::span<const CameraEntry> cameras) {
    nlohmann::ordered_json out{{"headset_mm", {mark.headset_mm[0], mark.headset_mm[1], mark.headset_mm[2]}}};
    nlohmann::ordered_json names = nlohmann::ordered_json::array();
    for (std::size_t c = 0; c < cameras.size(); ++c)
        if (mark.is_seen_by(c)) names.push_back(cameras[c].name);
    if (names.size() < cameras.size()) out["cameras"] = names;
    return out;
}

// The entries that are cameras, one for each letter.
std::vector<const json*> camera_entries(const json& file) {
    std::vector<const json*> entries;
    std::set<std::string> letters;
    for (const char* key : {"cameras", "images"}) {
        const auto found = file.find(key);
        if (found == file.end() || !found->is_array()) continue;
        for (const json& entry : *found) {
            // A wrong entry is kept, so that it is complained about.
            if (!entry.is_object() || letters.insert(letter_of(entry, entries.size())).second)
                entries.push_back(&entry);
        }
        break;
    }
    return entries;
}

// Bits of the cameras that a mark's entry names; 0 when one of them is unknown or none is named.
std::uint8_t camera_bits(const json& entry, const std::vector<const json*>& cameras) {
    const auto every = static_cast<std::uint8_t>((1U << cameras.size()) - 1U);
    const auto named = entry.find("cameras");
    if (named == entry.end()) return every;
    if (!named->is_array()) return 0;
    std::uint8_t bits = 0;
    for (const json& letter : *named) {
        std::uint8_t bit = 0;
        for (std::size_t c = 0; c < cameras.size(); ++c) {
            if (letter.is_string() && cameras[c]->is_object() &&
                letter_of(*cameras[c], c) == letter.get<std::string>())
                bit = static_cast<std::uint8_t>(1U << c);
        }
        if (bit == 0) return 0;
        bits |= bit;
    }
    return bits;
}

}  // namespace

const char* lens_name(LensModel lens) {
    return lens == LensModel::kFisheye ? "fisheye" : "rational";
}

nlohmann::ordered_json camera_json(const CameraModel& camera) {
    nlohmann::ordered_json rotation = nlohmann::ordered_json::array();
    for (int r = 0; r < 3; ++r) {
        const auto row = camera.camera_from_headset.row(r);
        rotation.push_back({row[0], row[1], row[2]});
    }
    return {{"width", camera.width_px},
            {"height", camera.height_px},
            {"lens", lens_name(camera.lens)},
            {"fx_px", camera.fx_px},
            {"fy_px", camera.fy_px},
            {"cx", camera.cx_px},
            {"cy", camera.cy_px},
            {"k1", camera.k1},
            {"k2", camera.k2},
            {"p1", camera.p1},
            {"p2", camera.p2},
            {"k3", camera.k3},
            {"k4", camera.k4},
            {"k5", camera.k5},
            {"k6", camera.k6},
            {"row_time_us", camera.row_time_us},
            {"R", rotation},
            {"centre_mm", {camera.centre_mm[0], camera.centre_mm[1], camera.centre_mm[2]}}};
}

Result<std::vector<CameraModel>, FileError> parse_cameras(std::string_view text,
                                                          const std::filesystem::path& name) {
    const json file = json::parse(text, nullptr, /*allow_exceptions=*/false);
    if (file.is_discarded() || !file.is_object()) return file_failure(name, "is not a JSON object");
    const std::vector<const json*> entries = camera_entries(file);
    if (entries.empty()) return file_failure(name, "has neither \"cameras\" nor \"images\" with entries");
    if (entries.size() > kMaxCameras) {
        return file_failure(
            name, fmt::format("has {} cameras; a rig carries at most {}", entries.size(), kMaxCameras));
    }
    std::vector<CameraModel> cameras;
    for (std::size_t i = 0; i < entries.size(); ++i) {
        if (!entries[i]->is_object())
            return file_failure(name, fmt::format("camera number {} is not an object", i + 1));
        const std::string letter = printable(letter_of(*entries[i], i));
        EntryReader read(*entries[i], file);
        const bool one_focal_length = entries[i]->contains("f_px") || file.contains("f_px");
        const CameraModel camera = read_camera(read, one_focal_length);
        if (!read.fault().empty())
            return file_failure(name, fmt::format("camera {}: {}", letter, read.fault()));
        if (const auto ok = check_camera(camera); !ok) {
            return file_failure(name, fmt::format("camera {}: {}", letter, pack_error_text(ok.error())));
        }
        cameras.push_back(camera);
    }
    return cameras;
}

Result<std::vector<HelmetMark>, FileError> parse_reference_marks(std::string_view text,
                                                                 const std::filesystem::path& name) {
    const json file = json::parse(text, nullptr, /*allow_exceptions=*/false);
    if (file.is_discarded() || !file.is_object()) return file_failure(name, "is not a JSON object");
    std::vector<HelmetMark> marks;
    const auto list = file.find("reference_marks");
    if (list == file.end()) return marks;
    if (!list->is_array() || list->size() > kMaxReferenceMarks) {
        return file_failure(
            name, fmt::format("\"reference_marks\" is not a list of at most {} marks", kMaxReferenceMarks));
    }
    const std::vector<const json*> cameras = camera_entries(file);
    if (cameras.size() > kMaxCameras) return file_failure(name, "has more cameras than a rig carries");
    for (const json& entry : *list) {
        const std::size_t number = marks.size() + 1;
        HelmetMark mark;
        EntryReader read(entry, file);
        if (!entry.is_object())
            return file_failure(name, fmt::format("reference mark number {} is not an object", number));
        for (std::size_t i = 0; i < 3; ++i)
            mark.headset_mm[static_cast<int>(i)] = read.element("headset_mm", i);
        if (!read.fault().empty())
            return file_failure(name, fmt::format("reference mark number {}: {}", number, read.fault()));
        mark.cameras = camera_bits(entry, cameras);
        if (!check_reference_mark(mark, cameras.size())) {
            return file_failure(name, fmt::format("reference mark number {}: it is implausibly far, or "
                                                  "\"cameras\" is not a list of this file's cameras",
                                                  number));
        }
        marks.push_back(mark);
    }
    return marks;
}

Result<std::vector<HelmetMark>, FileError> load_reference_marks(const std::filesystem::path& path) {
    const auto text = read_whole_text(path);
    if (!text) return failure(text.error());
    if (text->size() > kMaxCameraFileBytes) return file_failure(path, "is too large for a list of cameras");
    return parse_reference_marks(*text, path);
}

Result<std::vector<CameraModel>, FileError> load_cameras(const std::filesystem::path& path) {
    const auto text = read_whole_text(path);
    if (!text) return failure(text.error());
    if (text->size() > kMaxCameraFileBytes) return file_failure(path, "is too large for a list of cameras");
    return parse_cameras(*text, path);
}

Result<void, FileError> save_cameras(const std::filesystem::path& path, std::span<const CameraEntry> cameras,
                                     const std::string& note, std::span<const HelmetMark> marks) {
    nlohmann::ordered_json file;
    file["note"] = note;
    file["units"] =
        "pixels and millimetres; integer px = pixel centre, origin top-left; X_cam = R (X_headset - centre), "
        "camera axes x right, y down, z forward; row_time_us in microseconds a row";
    file["cameras"] = nlohmann::ordered_json::array();
    for (const CameraEntry& camera : cameras) file["cameras"].push_back(entry_of(camera));
    for (const HelmetMark& mark : marks) file["reference_marks"].push_back(mark_json(mark, cameras));
    std::ofstream out(path, std::ios::trunc);
    out << file.dump(1) << '\n';
    out.close();
    if (!out) return file_failure(path, "cannot be written; does the folder exist and is there space?");
    return {};
}

}  // namespace rig::host
