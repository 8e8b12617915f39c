#include "firmware_host/settings/shape_selection.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <numeric>

namespace rig {

namespace {

struct Region {
    std::string_view name;
    std::array<std::string_view, 3> parts;
};

constexpr std::array kRegions{Region{"brows", {"brow"}},
                              Region{"lids", {"eye", "lid", "blink"}},
                              Region{"cheeks", {"cheek"}},
                              Region{"nose", {"nose", "sneer", "nostril"}},
                              Region{"mouth", {"mouth", "lip", "tongue"}},
                              Region{"jaw", {"jaw", "chin"}}};

std::string lower(std::string_view text) {
    std::string result(text);
    std::transform(result.begin(), result.end(), result.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return result;
}

// What is left of a shape's name without its side; the whole name and kNone when it is on neither side.
enum class Side { kNone, kLeft, kRight };
struct SidedName {
    Side side = Side::kNone;
    std::string stem;
};

SidedName sided(std::string_view name) {
    const std::string text = lower(name);
    const auto is_whole = [](std::string_view stem) {
        return stem == "jaw" || stem == "mouth" || stem == "tongue" || stem.empty();
    };
    for (const auto& [ending, side] : {std::pair<std::string_view, Side>{"_l", Side::kLeft},
                                       {".l", Side::kLeft},
                                       {"-l", Side::kLeft},
                                       {"_r", Side::kRight},
                                       {".r", Side::kRight},
                                       {"-r", Side::kRight},
                                       {"left", Side::kLeft},
                                       {"right", Side::kRight}}) {
        if (!text.ends_with(ending)) continue;
        const std::string stem = text.substr(0, text.size() - ending.size());
        if (!is_whole(stem)) return {side, stem};
    }
    for (const auto& [start, side] : {std::pair<std::string_view, Side>{"l_", Side::kLeft},
                                      {"left_", Side::kLeft},
                                      {"r_", Side::kRight},
                                      {"right_", Side::kRight}}) {
        if (text.starts_with(start) && text.size() > start.size()) return {side, text.substr(start.size())};
    }
    return {Side::kNone, text};
}

template <class Wanted>
std::vector<std::size_t> indices(ShapeNames names, Wanted wanted) {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < names.size(); ++i) {
        if (wanted(names[i])) found.push_back(i);
    }
    return found;
}

}  // namespace

Result<std::vector<std::size_t>, std::string> select_shapes(std::string_view selector, ShapeNames names) {
    // A shape that is called like a region is that shape.
    if (auto exact = indices(names, [&](std::string_view name) { return name == selector; }); !exact.empty())
        return exact;
    if (selector == "all") return indices(names, [](std::string_view) { return true; });
    if (selector == "left" || selector == "right") {
        const Side side = selector == "left" ? Side::kLeft : Side::kRight;
        return indices(names, [&](std::string_view name) { return sided(name).side == side; });
    }
    for (const Region& region : kRegions) {
        if (region.name != selector) continue;
        return indices(names, [&](std::string_view name) {
            const std::string text = lower(name);
            return std::any_of(region.parts.begin(), region.parts.end(), [&](std::string_view part) {
                return !part.empty() && text.find(part) != std::string::npos;
            });
        });
    }
    return failure("'" + std::string(selector) + "' is neither a shape of this rig nor a region (" +
                   std::string(kRegionList) + ")");
}

std::vector<SidePair> side_pairs(ShapeNames names) {
    std::vector<SidedName> parts;
    for (const std::string_view name : names) parts.push_back(sided(name));
    std::vector<SidePair> pairs;
    for (std::size_t l = 0; l < parts.size(); ++l) {
        if (parts[l].side != Side::kLeft) continue;
        for (std::size_t r = 0; r < parts.size(); ++r) {
            if (parts[r].side != Side::kRight || parts[r].stem != parts[l].stem) continue;
            pairs.push_back({l, r});
            break;
        }
    }
    return pairs;
}

}  // namespace rig
