#include "firmware_host/settings/settings_file.hpp"

#include <algorithm>
#include <charconv>
#include <optional>

#include "firmware_host/settings/filter_table.hpp"

namespace rig {

namespace {

constexpr std::uintmax_t kLargestFile = 1 << 20;

std::string text_of(double value) {
    std::array<char, 32> digits{};
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value);
    return {digits.data(), end.ptr};
}

// "2", "0,0.8", "1"; nothing for a value that is no number, pair of numbers or truth.
std::optional<std::string> value_text(const toml::node& node) {
    if (const auto truth = node.value<bool>(); truth && node.is_boolean())
        return std::string(*truth ? "1" : "0");
    if (node.is_number()) return text_of(*node.value<double>());
    const toml::array* const list = node.as_array();
    if (list == nullptr || list->size() != 2 || !list->get(0)->is_number() || !list->get(1)->is_number())
        return std::nullopt;
    return text_of(*list->get(0)->value<double>()) + "," + text_of(*list->get(1)->value<double>());
}

struct Line {
    std::uint32_t number = 0;
    std::string text;
};

std::string read_controls(const toml::table& table, std::vector<std::string>& into) {
    std::vector<Line> lines;
    for (const auto& [who, wishes] : table) {
        const toml::table* const of_one = wishes.as_table();
        if (of_one == nullptr) return "'controls." + std::string(who.str()) + "' must be a table";
        for (const auto& [what, node] : *of_one) {
            const auto value = value_text(node);
            const std::string name = std::string(who.str()) + "." + std::string(what.str());
            if (!value) return "'" + name + "' must be a number, two in a list, or true or false";
            lines.push_back({node.source().begin.line, name + "=" + *value});
        }
    }
    std::stable_sort(lines.begin(), lines.end(),
                     [](const Line& a, const Line& b) { return a.number < b.number; });
    for (Line& line : lines) into.push_back(std::move(line.text));
    return "";
}

std::string read_settings(const toml::table& table, SettingsFile& into) {
    for (const auto& [key, value] : table) {
        const toml::table* const part = value.as_table();
        std::string fault;
        if (part != nullptr && key.str() == "smoothing") {
            fault = read_filter_settings(*part, into.smoothing);
        } else if (part != nullptr && key.str() == "controls") {
            fault = read_controls(*part, into.controls);
        } else {
            fault = "there is no '" + std::string(key.str()) + "'; there are [smoothing] and [controls.WHO]";
        }
        if (!fault.empty()) return fault;
    }
    return "";
}

}  // namespace

Result<SettingsFile, std::string> read_settings_file(const std::filesystem::path& path) {
    std::error_code fault;
    const auto size = std::filesystem::file_size(path, fault);
    if (fault) return failure(path.string() + ": " + fault.message());
    if (size > kLargestFile) return failure(path.string() + ": is over 1 MiB and no settings file");
    const toml::parse_result parsed = toml::parse_file(path.string());
    if (!parsed) {
        return failure(path.string() + ": line " + std::to_string(parsed.error().source().begin.line) + ": " +
                       std::string(parsed.error().description()));
    }
    SettingsFile settings;
    if (const std::string wrong = read_settings(parsed.table(), settings); !wrong.empty())
        return failure(path.string() + ": " + wrong);
    return settings;
}

}  // namespace rig
