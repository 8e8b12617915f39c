#include "firmware_host/settings/filter_table.hpp"

#include <algorithm>

namespace rig {

namespace {

// In the order of the file: where regions overlap, the later line wins.
std::string read_shapes(const toml::table& table, FilterSettings& into) {
    struct Line {
        std::uint32_t number = 0;
        std::string selector;
        std::string filter;
    };
    std::vector<Line> lines;
    for (const auto& [selector, filter] : table) {
        const auto text = filter.value<std::string>();
        if (!text) return "'shapes." + std::string(selector.str()) + "' must name a filter";
        lines.push_back({filter.source().begin.line, std::string(selector.str()), *text});
    }
    std::stable_sort(lines.begin(), lines.end(),
                     [](const Line& a, const Line& b) { return a.number < b.number; });
    for (Line& line : lines) into.shapes.emplace_back(std::move(line.selector), std::move(line.filter));
    return "";
}

}  // namespace

std::string read_filter_settings(const toml::table& table, FilterSettings& into) {
    for (const auto& [key, value] : table) {
        const std::string name(key.str());
        if (name == "filter") {
            into.kind = filter_kind(value.value_or(std::string()));
            if (!into.kind) return "'filter' must be \"none\", \"one-euro\" or \"savitzky-golay\"";
        } else if (name == "window" || name == "delay") {
            const auto frames = value.value<std::int64_t>();
            if (!frames || *frames < 0 || *frames > static_cast<std::int64_t>(kMaxWindowFrames))
                return "'" + name + "' must be a number of frames up to 61";
            (name == "window" ? into.window_frames : into.delay_frames) = static_cast<int>(*frames);
        } else if (name == "shapes" && value.is_table()) {
            if (const std::string fault = read_shapes(*value.as_table(), into); !fault.empty()) return fault;
        } else {
            return "there is no key '" + name + "'; there are filter, window, delay and [shapes]";
        }
    }
    return "";
}

}  // namespace rig
