#include <array>
#include <cctype>
#include <string>
#include <string_view>

#include "tests/hygiene/rules.hpp"

namespace rig::hygiene {

namespace {

template <class Check>
Violations for_each_line(const SourceTree& tree, Check check) {
    Violations violations;
    for (const auto& [path, file] : tree.files()) {
        int number = 0;
        for (const std::string_view line : file.lines()) {
            ++number;
            const std::string what = check(line);
            if (!what.empty()) violations.push_back({path, number, what});
        }
    }
    return violations;
}

// An absolute path, not the tail of a relative one such as tests/work.
bool stands_alone(std::string_view line, std::size_t at) {
    if (at == 0) return true;
    const char before = line[at - 1];
    return std::isalnum(static_cast<unsigned char>(before)) == 0 &&
           std::string_view("._-/}").find(before) == std::string_view::npos;
}

}  // namespace

Violations whitespace(const SourceTree& tree) {
    Violations violations = for_each_line(tree, [](std::string_view line) -> std::string {
        if (line.find('\t') != std::string_view::npos) return "tab";
        if (line.ends_with('\r')) return "carriage return";
        return line.ends_with(' ') ? "trailing blank" : "";
    });
    for (const auto& [path, file] : tree.files()) {
        if (!file.text.empty() && !file.text.ends_with('\n'))
            violations.push_back({path, 0, "does not end with a newline"});
    }
    return violations;
}

Violations machine_paths(const SourceTree& tree) {
    // Folder names alone, so that this file keeps its own rule.
    constexpr std::array<std::string_view, 4> kRoots{"work", "farm", "home", "root"};
    return for_each_line(tree, [&](std::string_view line) -> std::string {
        for (const std::string_view root : kRoots) {
            const std::string path = "/" + std::string(root) + "/";
            for (std::size_t at = line.find(path); at != std::string_view::npos;
                 at = line.find(path, at + 1)) {
                if (stands_alone(line, at))
                    return "a path of one machine: " + std::string(line.substr(at, 40));
            }
        }
        return "";
    });
}

Violations header_form(const SourceTree& tree) {
    Violations violations;
    for (const auto& [path, file] : tree.files()) {
        if (!file.is_header()) continue;
        if (!file.text.starts_with("// "))
            violations.push_back({path, 1, "does not open with what it is for"});
        if (file.text.find("\n#pragma once\n") == std::string::npos)
            violations.push_back({path, 0, "no #pragma once"});
    }
    return violations;
}

}  // namespace rig::hygiene
