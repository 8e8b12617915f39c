#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <string_view>
#include <vector>

#include "tests/hygiene/rules.hpp"

namespace rig::hygiene {

namespace {

std::string lower(std::string_view text) {
    std::string result(text);
    std::transform(result.begin(), result.end(), result.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return result;
}

bool is_upper(char c) {
    return std::isupper(static_cast<unsigned char>(c)) != 0;
}

// FrameSource_fooBar -> frame, source, foo, bar
std::vector<std::string> words_of(std::string_view name) {
    std::vector<std::string> words(1);
    for (std::size_t i = 0; i < name.size(); ++i) {
        const bool next_word = i > 0 && is_upper(name[i]) && !is_upper(name[i - 1]);
        if (name[i] == '_' || name[i] == '.' || name[i] == '/' || next_word) words.emplace_back();
        if (std::isalnum(static_cast<unsigned char>(name[i])) != 0) words.back() += lower(name.substr(i, 1));
    }
    return words;
}

// The first word of a name that says nothing, or nothing.
std::string empty_word(std::string_view name) {
    constexpr std::array<std::string_view, 7> kEmpty{"impl",    "manager", "managers", "helper",
                                                     "helpers", "util",    "utils"};
    for (const std::string& word : words_of(name)) {
        if (std::find(kEmpty.begin(), kEmpty.end(), word) != kEmpty.end()) return word;
    }
    return {};
}

}  // namespace

Violations product_name(const SourceTree& tree) {
    Violations violations;
    for (const auto& [path, file] : tree.files()) {
        for (const Token& token : file.code.tokens) {
            if (token.kind != TokenKind::kIdentifier ||
                lower(token.text).find("headrig") == std::string::npos)
                continue;
            violations.push_back(
                {path, token.line, "the product's name is in an identifier: " + std::string(token.text)});
        }
    }
    return violations;
}

Violations empty_names(const SourceTree& tree) {
    Violations violations;
    for (const auto& [path, file] : tree.files()) {
        if (!empty_word(path).empty())
            violations.push_back({path, 0, "file or folder is called " + empty_word(path)});
        for (const Token& token : file.code.tokens) {
            if (token.kind != TokenKind::kIdentifier) continue;
            const std::string word = empty_word(token.text);
            if (!word.empty())
                violations.push_back({path, token.line, std::string(token.text) + " says nothing: " + word});
        }
    }
    return violations;
}

}  // namespace rig::hygiene
