#include "firmware_host/companion/calibrate/shot_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <set>

#include "core/limits.hpp"

namespace rig::host {

namespace {

namespace fs = std::filesystem;

bool is_picture(const fs::path& path) {
    std::string ending = path.extension().string();
    std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
    return ending == ".png" || ending == ".pgm" || ending == ".jpg" || ending == ".jpeg";
}

struct NamedShots {
    std::string camera;
    std::map<std::string, fs::path> files;  // by moment
};

Result<NamedShots, FileError> shots_of_folder(const fs::path& folder) {
    NamedShots out;
    out.camera = (folder.has_filename() ? folder : folder.parent_path()).filename().string();
    const auto files = pictures_in(folder);
    if (!files) return failure(files.error());
    for (const fs::path& file : *files) {
        const auto [at, fresh] = out.files.emplace(file.stem().string(), file);
        if (!fresh)
            return file_failure(file,
                                fmt::format("has the same name as {}; which of them is the moment's picture?",
                                            at->second.filename().string()));
    }
    if (out.files.empty()) return file_failure(folder, "has no .png, .pgm or .jpg pictures in it");
    return out;
}

Result<NamedShots, FileError> shots_of_pattern(const fs::path& pattern) {
    const std::string name = pattern.filename().string();
    const std::size_t star = name.find('*');
    if (star == std::string::npos || name.find('*', star + 1) != std::string::npos ||
        pattern.parent_path().string().find('*') != std::string::npos) {
        return file_failure(
            pattern, "is neither a folder nor a pattern with one * in the file's name, e.g. 'a_*.png'");
    }
    const std::string before = name.substr(0, star);
    const std::string after = name.substr(star + 1);
    NamedShots out;
    out.camera = before + after.substr(0, after.rfind('.'));
    while (!out.camera.empty() && (out.camera.back() == '_' || out.camera.back() == '-'))
        out.camera.pop_back();
    while (!out.camera.empty() && (out.camera.front() == '_' || out.camera.front() == '-'))
        out.camera.erase(0, 1);
    const auto files = pictures_in(pattern.has_parent_path() ? pattern.parent_path() : fs::path("."));
    if (!files) return failure(files.error());
    for (const fs::path& file : *files) {
        const std::string each = file.filename().string();
        if (each.size() < before.size() + after.size() || !each.starts_with(before) || !each.ends_with(after))
            continue;
        out.files.emplace(each.substr(before.size(), each.size() - before.size() - after.size()), file);
    }
    if (out.files.empty()) return file_failure(pattern, "no picture's name matches");
    return out;
}

Result<ShotList, FileError> joined(std::vector<NamedShots> cameras) {
    ShotList list;
    if (cameras.size() > kMaxCameras) {
        return failure(FileError{
            fmt::format("pictures of {} cameras; a rig carries at most {}", cameras.size(), kMaxCameras)});
    }
    std::map<std::string, std::size_t> moments;
    for (const NamedShots& camera : cameras) {
        for (const auto& [moment, file] : camera.files) moments.emplace(moment, 0);
    }
    std::size_t number = 0;
    for (auto& [moment, index] : moments) index = number++;
    std::set<std::string> names;
    for (std::size_t c = 0; c < cameras.size(); ++c) {
        std::string name = cameras[c].camera;
        if (name.empty()) name = std::string(1, static_cast<char>('a' + c));
        if (!names.insert(name).second)
            return failure(FileError{fmt::format("two cameras are called {}; rename a folder", name)});
        list.cameras.push_back(name);
        for (const auto& [moment, file] : cameras[c].files)
            list.shots.push_back({c, moments.at(moment), file});
    }
    return list;
}

}  // namespace

Result<std::vector<fs::path>, FileError> pictures_in(const fs::path& folder) {
    std::error_code fault;
    std::vector<fs::path> files;
    for (fs::directory_iterator at(folder, fault), end; !fault && at != end; at.increment(fault)) {
        if (is_picture(at->path())) files.push_back(at->path());
    }
    if (fault) return file_failure(folder, fmt::format("cannot be opened: {}", fault.message()));
    std::ranges::sort(files);
    return files;
}

Result<ShotList, FileError> find_shots(const std::vector<std::string>& arguments) {
    std::vector<NamedShots> cameras;
    for (const std::string& argument : arguments) {
        std::error_code ignored;
        auto shots =
            fs::is_directory(argument, ignored) ? shots_of_folder(argument) : shots_of_pattern(argument);
        if (!shots) return failure(shots.error());
        cameras.push_back(std::move(*shots));
    }
    return joined(std::move(cameras));
}

Result<ShotList, FileError> find_shots_by_name(const fs::path& folder) {
    const auto files = pictures_in(folder);
    if (!files) return failure(files.error());
    std::map<std::string, NamedShots> cameras;
    for (const fs::path& file : *files) {
        const std::string stem = file.stem().string();
        const std::size_t mark = stem.rfind('_');
        if (mark == std::string::npos || mark == 0 || mark + 1 == stem.size())
            return file_failure(file,
                                "is not named MOMENT_CAMERA, e.g. 012_a.png; give a folder a camera instead");
        NamedShots& camera = cameras[stem.substr(mark + 1)];
        camera.camera = stem.substr(mark + 1);
        camera.files.emplace(stem.substr(0, mark), file);
    }
    if (cameras.empty()) return file_failure(folder, "has no .png, .pgm or .jpg pictures in it");
    std::vector<NamedShots> list;
    for (auto& [name, shots] : cameras) list.push_back(std::move(shots));
    return joined(std::move(list));
}

}  // namespace rig::host
