#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "tests/hygiene/rules.hpp"

namespace rig::hygiene {

namespace {

constexpr int kMaxReadmeLines = 80;  // a page
constexpr int kFaultCount = 55;      // of the reliability catalogue

// Folders that explain themselves. One that does not exist yet is passed over.
constexpr std::array<std::string_view, 25> kReadmeFolders{"core",
                                                          "core/base",
                                                          "core/image",
                                                          "core/geometry",
                                                          "core/detect",
                                                          "core/expose",
                                                          "core/track",
                                                          "core/stabilise",
                                                          "core/infer",
                                                          "core/solve",
                                                          "core/filter",
                                                          "core/pack",
                                                          "core/wire",
                                                          "core/pipeline",
                                                          "hal",
                                                          "hal/linux",
                                                          "hal/sim",
                                                          "boards",
                                                          "boards/sim",
                                                          "firmware_host",
                                                          "firmware_host/daemon",
                                                          "firmware_host/companion",
                                                          "tests",
                                                          "scripts",
                                                          "cmake"};

std::string folder_of(std::string_view path) {
    return std::string(path.substr(0, path.rfind('/')));
}

bool names_word(std::string_view text, std::string_view word) {
    constexpr std::string_view kEnds = " \t\n()/\"";
    for (std::size_t at = text.find(word); at != std::string_view::npos; at = text.find(word, at + 1)) {
        const std::size_t end = at + word.size();
        const bool begins = at == 0 || kEnds.find(text[at - 1]) != std::string_view::npos;
        if (begins && (end == text.size() || kEnds.find(text[end]) != std::string_view::npos)) return true;
    }
    return false;
}

std::string trimmed(std::string_view text) {
    const std::size_t begin = text.find_first_not_of(' ');
    if (begin == std::string_view::npos) return {};
    return std::string(text.substr(begin, text.find_last_not_of(' ') - begin + 1));
}

struct Command {
    std::string text;
    std::string comment;  // after " # "
    int line = 0;
};

// The commands of the ```sh blocks, with lines that end in a backslash joined.
std::vector<Command> commands_of(const SourceFile& readme) {
    std::vector<Command> commands;
    bool inside = false;
    int number = 0;
    std::string joined;
    for (const std::string_view line : readme.lines()) {
        ++number;
        if (line.starts_with("```")) {
            inside = line == "```sh";
            continue;
        }
        if (!inside) continue;
        joined += line;
        if (joined.ends_with('\\')) {
            joined.pop_back();
            continue;
        }
        const std::size_t comment = joined.starts_with('#') ? 0 : joined.find(" # ");
        const std::string text = trimmed(std::string_view(joined).substr(0, comment));
        if (!text.empty()) {
            commands.push_back(
                {text,
                 comment == std::string::npos ? "" : trimmed(std::string_view(joined).substr(comment + 3)),
                 number});
        }
        joined.clear();
    }
    return commands;
}

bool ci_runs(const SourceFile& ci, std::string_view command) {
    const std::vector<std::string_view> lines = ci.lines();
    return std::any_of(lines.begin(), lines.end(), [&](std::string_view line) {
        const std::string text = trimmed(line);
        const std::size_t at = text.find(command);
        if (text.starts_with('#') || at == std::string::npos) return false;
        // The whole command: what follows may only be another part of the shell's line.
        const std::size_t end = at + command.size();
        return end == text.size() || text.substr(end).starts_with(" <") || text.substr(end).starts_with(" |");
    });
}

}  // namespace

Violations unit_tests(const SourceTree& tree) {
    Violations violations;
    for (const auto& [path, file] : tree.files()) {
        if (!file.is_under("core") || !path.ends_with(".cpp")) continue;
        const std::string test = "tests/unit/" + path.substr(0, path.size() - 4) + "_test.cpp";
        if (tree.find(test) == nullptr) violations.push_back({path, 0, "has no " + test});
    }
    return violations;
}

Violations listed_sources(const SourceTree& tree) {
    Violations violations;
    for (const auto& [path, file] : tree.files()) {
        if (!path.ends_with(".cpp")) continue;
        const std::string name = path.substr(path.rfind('/') + 1);
        bool listed = false;
        // The CMakeLists.txt beside it, or one of a folder above or of cmake/ that names it.
        for (std::string folder = folder_of(path); !listed; folder = folder_of(folder)) {
            const SourceFile* const list = tree.find(folder + "/CMakeLists.txt");
            listed = list != nullptr && names_word(list->text, name);
            if (folder.find('/') == std::string::npos) break;
        }
        const SourceFile* const fuzz = tree.find("cmake/RigFuzz.cmake");
        listed = listed || (fuzz != nullptr && fuzz->text.find(path) != std::string::npos);
        if (!listed) violations.push_back({path, 0, "no CMakeLists.txt builds it"});
    }
    return violations;
}

Violations folder_readmes(const SourceTree& tree) {
    Violations violations;
    for (const std::string_view folder : kReadmeFolders) {
        if (!tree.has_folder(folder)) continue;
        const std::string path = std::string(folder) + "/README.md";
        const SourceFile* const readme = tree.find(path);
        if (readme == nullptr) {
            violations.push_back({path, 0, "is missing"});
            continue;
        }
        std::string last_heading;
        const std::vector<std::string_view> lines = readme->lines();
        for (const std::string_view line : lines) {
            if (line.starts_with("#")) last_heading = line;
        }
        if (last_heading.find("Decisions") == std::string::npos)
            violations.push_back({path, 0, "does not end with Decisions"});
        if (lines.size() > kMaxReadmeLines)
            violations.push_back({path, 0, std::to_string(lines.size()) + " lines: more than a page"});
    }
    return violations;
}

Violations fault_codes(const SourceTree& tree) {
    const std::string path = "core/base/faults.hpp";
    const SourceFile* const file = tree.find(path);
    if (file == nullptr) return {{path, 0, "is missing"}};
    std::map<int, int> uses;
    const std::vector<Token>& tokens = file->code.tokens;
    for (std::size_t i = 0; i + 3 < tokens.size(); ++i) {
        const bool enumerator = tokens[i].text.starts_with('k') && tokens[i + 1].text == "=" &&
                                tokens[i + 2].kind == TokenKind::kNumber && tokens[i + 3].text == ",";
        if (enumerator) ++uses[std::atoi(std::string(tokens[i + 2].text).c_str())];
    }
    Violations violations;
    for (int code = 1; code <= kFaultCount; ++code) {
        if (uses[code] != 1)
            violations.push_back(
                {path, 0, "F" + std::to_string(code) + " stands " + std::to_string(uses[code]) + " times"});
    }
    for (const auto& [code, count] : uses) {
        if (code < 1 || code > kFaultCount)
            violations.push_back({path, 0, "F" + std::to_string(code) + " is not in the catalogue"});
    }
    return violations;
}

Violations readme_commands(const SourceTree& tree) {
    const SourceFile* const readme = tree.find("README.md");
    const SourceFile* const ci = tree.find(".ci/run");
    if (readme == nullptr || ci == nullptr)
        return {{readme == nullptr ? "README.md" : ".ci/run", 0, "is missing"}};
    constexpr std::string_view kExcuse = "not in CI:";
    Violations violations;
    for (const Command& command : commands_of(*readme)) {
        const bool excused =
            command.comment.starts_with(kExcuse) && command.comment.size() > kExcuse.size() + 1;
        if (!excused && !ci_runs(*ci, command.text))
            violations.push_back({"README.md", command.line, ".ci/run does not run: " + command.text});
    }
    return violations;
}

}  // namespace rig::hygiene
