#include "firmware_host/companion/links/head_csv.hpp"

#include <fmt/format.h>

#include <array>
#include <iterator>

#include "firmware_host/companion/links/session_text.hpp"

namespace rig::host {

namespace {

constexpr const char* kColumns =
    "frame,time_s,status,turn_x_rad,turn_y_rad,turn_z_rad,place_x_mm,place_y_mm,place_z_mm,sigma_turn_x_rad,"
    "sigma_turn_y_rad,sigma_turn_z_rad,sigma_place_x_mm,sigma_place_y_mm,sigma_place_z_mm,rms_px,points\n";

void put(fmt::memory_buffer& line, const std::array<float, 3>& values, int digits) {
    for (const float value : values) fmt::format_to(std::back_inserter(line), ",{:.{}f}", value, digits);
}

}  // namespace

std::filesystem::path head_csv_path(const std::filesystem::path& weights_csv) {
    std::filesystem::path path = weights_csv;
    path.replace_filename(weights_csv.stem().string() + ".head.csv");
    return path;
}

Result<HeadCsv, FileError> HeadCsv::create(const std::filesystem::path& path) {
    HeadCsv csv(path);
    csv.file_ << kColumns << std::flush;
    if (!csv.file_) return file_failure(path, "cannot be written: does its folder exist, and is there room?");
    return csv;
}

Result<void, FileError> HeadCsv::add(const FaceState& state) {
    const HeadPlace& head = state.head;
    const bool known = head.status == HeadStatus::kKnown;
    if (!first_sequence_) first_sequence_ = state.sequence;
    // A row whose head was lost on the way has no time of its own.
    if (!first_capture_us_ && head.capture_us != 0) first_capture_us_ = head.capture_us;
    const std::int64_t since_us = head.capture_us != 0 ? head.capture_us - *first_capture_us_ : 0;
    fmt::memory_buffer line;
    fmt::format_to(std::back_inserter(line), "{},",
                   static_cast<std::int32_t>(state.sequence - *first_sequence_));
    if (head.capture_us != 0)
        fmt::format_to(std::back_inserter(line), "{:.6f}", static_cast<double>(since_us) * 1e-6);
    fmt::format_to(std::back_inserter(line), ",{}", head_word(head.status));
    if (known) {
        put(line, head.rotation_rad, 6);
        put(line, head.translation_mm, 3);
        put(line, head.rotation_sigma_rad, 6);
        put(line, head.translation_sigma_mm, 3);
        fmt::format_to(std::back_inserter(line), ",{:.3f},{}\n", head.rms_px, head.points_used);
        ++known_count_;
    } else {
        fmt::format_to(std::back_inserter(line), "{:,>14}\n", "");
    }
    file_.write(line.data(), static_cast<std::streamsize>(line.size()));
    if (!file_) return file_failure(path_, "writing failed: is the disk full?");
    ++row_count_;
    return {};
}

Result<void, FileError> HeadCsv::close() {
    file_.close();
    if (!file_) return file_failure(path_, "writing failed: is the disk full?");
    return {};
}

}  // namespace rig::host
