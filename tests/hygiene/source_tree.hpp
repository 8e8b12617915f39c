// The repository's text files in memory, so that rules run alike on the real tree and on planted ones.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "tests/hygiene/lexer.hpp"

namespace rig::hygiene {

struct SourceFile {
    std::string path;  // from the root, with slashes
    std::string text;
    Lexed code;  // of C++ files; views into `text`

    [[nodiscard]] bool is_cpp() const { return path.ends_with(".cpp") || path.ends_with(".hpp"); }
    [[nodiscard]] bool is_header() const { return path.ends_with(".hpp"); }
    [[nodiscard]] bool is_under(std::string_view folder) const {
        return path.size() > folder.size() && path.starts_with(folder) && path[folder.size()] == '/';
    }
    [[nodiscard]] std::vector<std::string_view> lines() const;
};

class SourceTree {
  public:
    // Every text file of the repository at `root`, without build, out and binary data.
    [[nodiscard]] static SourceTree load(const std::filesystem::path& root);

    void add(std::string path, std::string text);
    [[nodiscard]] const std::map<std::string, SourceFile, std::less<>>& files() const { return files_; }
    [[nodiscard]] const SourceFile* find(std::string_view path) const;
    [[nodiscard]] bool has_folder(std::string_view folder) const;

  private:
    std::map<std::string, SourceFile, std::less<>> files_;  // nodes do not move: `code` views stay valid
};

}  // namespace rig::hygiene
