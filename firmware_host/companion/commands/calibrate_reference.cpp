#include "firmware_host/companion/commands/calibrate_reference.hpp"

#include <fmt/format.h>

#include <fstream>

#include "firmware_host/companion/train/camera_file.hpp"
#include "firmware_host/pack_file/opened_pack.hpp"

namespace rig::host {

namespace {

bool begins_like_json(const std::filesystem::path& path) {
    std::ifstream file(path);
    char first = 0;
    return !(file >> first) || first == '{';  // what cannot be read is complained about as a camera file
}

Result<RigReference, FileError> of_pack(const std::filesystem::path& path) {
    const auto opened = open_pack_file(path);
    if (!opened) return failure(FileError{opened.error().message});
    const SolvePack& pack = opened->pack();
    if (pack.camera_count == 0)
        return file_failure(path, "is a pack without cameras; give the rig's cameras.json");
    RigReference out;
    out.cameras.assign(pack.cameras.begin(), pack.cameras.begin() + pack.camera_count);
    out.marks.assign(pack.helmet_marks().begin(), pack.helmet_marks().end());
    return out;
}

}  // namespace

Result<RigReference, FileError> load_rig_reference(const std::filesystem::path& path) {
    if (!begins_like_json(path)) return of_pack(path);
    auto cameras = load_cameras(path);
    if (!cameras) return failure(cameras.error());
    auto marks = load_reference_marks(path);
    if (!marks) return failure(marks.error());
    return RigReference{std::move(*cameras), std::move(*marks)};
}

std::string marks_at_stake(const std::filesystem::path& out) {
    std::error_code ignored;
    if (!std::filesystem::exists(out, ignored)) return {};
    const auto marks = load_reference_marks(out);
    if (!marks || marks->empty()) return {};  // a file without them, or none that any program reads
    return fmt::format(
        "{}: holds {} reference marks of the helmet, which would be lost: their places mean nothing in a "
        "guessed "
        "headset frame. --reference {} keeps frame and marks; with another --out that file stays as it is",
        out.string(), marks->size(), out.string());
}

}  // namespace rig::host
