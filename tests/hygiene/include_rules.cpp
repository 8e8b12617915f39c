#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "tests/hygiene/rules.hpp"

namespace rig::hygiene {

namespace {

using Paths = std::vector<std::string_view>;

// A room and what it may include besides itself: files, or folders with everything under them.
struct Room {
    std::string_view folder;
    Paths sees;
};

// What a stage hands on is all that later stages may see of it.
constexpr std::string_view kDetectOutput = "core/detect/observation.hpp";
constexpr std::string_view kTrackOutput = "core/track/named_markers.hpp";
constexpr std::string_view kStabiliseOutput = "core/stabilise/stabilised_markers.hpp";
constexpr std::string_view kInferOutput = "core/infer/completed_markers.hpp";
constexpr std::string_view kSolveOutput = "core/solve/solved_weights.hpp";
constexpr std::string_view kPackView =
    "core/pack/solve_pack.hpp";  // plain data: what was computed beforehand
constexpr std::string_view kImageView = "core/image/view.hpp";

// The longest folder that matches decides. A folder that is not here sees everything below `firmware_host`.
const std::vector<Room>& rooms() {
    static const Paths kGround{"core/base", "core/limits.hpp"};
    static const auto with_ground = [](Paths more) {
        more.insert(more.end(), kGround.begin(), kGround.end());
        return more;
    };
    static const std::vector<Room> kRooms{
        {"core", {}},
        {"core/base", {"core/limits.hpp"}},
        {"core/image", kGround},
        {"core/geometry", kGround},
        {"core/pack", with_ground({"core/geometry"})},
        {"core/detect", with_ground({"core/image", "core/geometry"})},
        {"core/expose", kGround},
        {"core/track", with_ground({"core/geometry", kPackView, kDetectOutput})},
        {"core/stabilise", with_ground({"core/geometry", kPackView, kDetectOutput, kTrackOutput})},
        {"core/infer", with_ground({"core/geometry", kPackView, kTrackOutput, kStabiliseOutput})},
        {"core/classify",
         with_ground({"core/image", "core/geometry", kPackView, kTrackOutput, kStabiliseOutput})},
        {"core/solve",
         with_ground({"core/geometry", kPackView, kTrackOutput, kStabiliseOutput, kInferOutput})},
        {"core/filter", with_ground({kPackView, kTrackOutput, kStabiliseOutput, kInferOutput, kSolveOutput})},
        {"core/wire",
         with_ground({kDetectOutput, kTrackOutput, kStabiliseOutput, kInferOutput, kSolveOutput})},
        {"core/pipeline", {"core"}},
        {"hal", with_ground({kImageView})},
        {"hal/linux", with_ground({"hal/", "core/image"})},
        // The simulated world contradicts core only as long as it shares none of core's stages or geometry.
        // It shares the wrappers of system calls with hal/linux: errno stops there.
        {"hal/sim", with_ground({"hal/", "core/image", "hal/linux/descriptor.hpp",
                                 "hal/linux/system_call.hpp", "hal/linux/monotonic_clock.hpp"})},
        {"firmware_host/companion/world",
         with_ground({"firmware_host/companion", "hal/sim/world_protocol.hpp", kImageView})},
        // What both programs need; neither sees the other.
        {"firmware_host/pack_file", {"core", "hal"}},
        {"firmware_host/settings", {"core"}},
        {"firmware_host/take_log", {"core"}},
        {"firmware_host/companion",
         {"core", "hal", "firmware_host/companion", "firmware_host/pack_file", "firmware_host/settings",
          "firmware_host/take_log"}},
        {"firmware_host/daemon",
         {"core", "hal", "firmware_host/daemon", "firmware_host/pack_file", "firmware_host/settings",
          "firmware_host/take_log"}},
        {"tests", {"core", "hal", "firmware_host", "tests"}},
    };
    return kRooms;
}

bool is_inside(std::string_view path, std::string_view folder) {
    return path.size() > folder.size() && path.starts_with(folder) && path[folder.size()] == '/';
}

const Room* room_of(std::string_view path) {
    const Room* best = nullptr;
    for (const Room& room : rooms()) {
        if (is_inside(path, room.folder) && (best == nullptr || room.folder.size() > best->folder.size()))
            best = &room;
    }
    return best;
}

// "hal/" means the files of hal itself; "hal" everything under it.
bool matches(std::string_view include, std::string_view seen) {
    if (seen.ends_with('/'))
        return include.starts_with(seen) && include.find('/', seen.size()) == std::string_view::npos;
    return include == seen || is_inside(include, seen);
}

bool may_see(const Room& room, std::string_view include) {
    const Room* const target = room_of(include);
    if (target != nullptr && target->folder == room.folder) return true;
    return std::any_of(room.sees.begin(), room.sees.end(), [&](auto seen) { return matches(include, seen); });
}

// FlatBuffers' compiler writes these into the build folder, spelled from the root like their schema.
bool is_generated(std::string_view include) {
    return include.ends_with("_generated.h");
}

bool is_backend(std::string_view path) {
    return is_inside(path, "hal/linux") || is_inside(path, "hal/sim");
}

template <class Check>
Violations for_each_include(const SourceTree& tree, Check check) {
    Violations violations;
    for (const auto& [path, file] : tree.files()) {
        for (const Include& include : file.code.includes) {
            const std::string what = check(file, include);
            if (!what.empty()) violations.push_back({path, include.line, what});
        }
    }
    return violations;
}

}  // namespace

Violations include_spelling(const SourceTree& tree) {
    return for_each_include(tree, [&](const SourceFile&, const Include& include) -> std::string {
        const bool exists = tree.find(include.path) != nullptr;
        if (include.angled) return exists ? "our own header needs quotes: " + std::string(include.path) : "";
        if (exists || is_generated(include.path)) return "";
        return "no such file from the root: " + std::string(include.path);
    });
}

Violations include_directions(const SourceTree& tree) {
    return for_each_include(tree, [](const SourceFile& file, const Include& include) -> std::string {
        const Room* const room = room_of(file.path);
        if (room == nullptr || include.angled || may_see(*room, include.path)) return "";
        return std::string(room->folder) + " may not see " + std::string(include.path);
    });
}

Violations core_headers(const SourceTree& tree) {
    constexpr std::array<std::string_view, 18> kStandard{
        "algorithm", "array",   "bit",         "cmath",    "compare",     "concepts",
        "cstddef",   "cstdint", "cstring",     "expected", "limits",      "numeric",
        "optional",  "span",    "string_view", "tuple",    "type_traits", "utility"};
    return for_each_include(tree, [&](const SourceFile& file, const Include& include) -> std::string {
        const bool interface = file.is_under("hal") && !is_backend(file.path);
        if (!include.angled || !(file.is_under("core") || interface)) return "";
        if (std::find(kStandard.begin(), kStandard.end(), include.path) != kStandard.end()) return "";
        const bool manifests = file.is_under("core/pack") || file.is_under("core/wire");
        if (manifests && include.path.starts_with("flatbuffers/")) return "";
        if (file.path == "core/base/linalg.hpp" && include.path.starts_with("Eigen/")) return "";
        return "not on the allow-list: <" + std::string(include.path) + ">";
    });
}

Violations backend_naming(const SourceTree& tree) {
    return for_each_include(tree, [](const SourceFile& file, const Include& include) -> std::string {
        const bool wiring = file.path.ends_with("/wiring.cpp");
        const bool world =
            file.is_under("firmware_host/companion/world") && include.path == "hal/sim/world_protocol.hpp";
        if (!file.is_under("firmware_host") || wiring || world || !is_backend(include.path)) return "";
        return "only wiring.cpp names a concrete backend: " + std::string(include.path);
    });
}

}  // namespace rig::hygiene
