#include "tests/hygiene/source_tree.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <utility>

namespace rig::hygiene {

namespace {

namespace fs = std::filesystem;

bool is_text(const fs::path& path) {
    constexpr std::array<std::string_view, 14> kEndings{".cpp",     ".hpp",  ".md",   ".txt", ".cmake",
                                                        ".toml",    ".py",   ".sh",   ".fbs", ".rules",
                                                        ".service", ".json", ".conf", ".in"};
    const std::string name = path.filename().string();
    const std::string folder = path.parent_path().filename().string();
    const bool script = path.extension().empty() && (folder == "scripts" || folder == ".ci");
    return script ||
           std::any_of(kEndings.begin(), kEndings.end(), [&](auto end) { return name.ends_with(end); });
}

bool is_skipped_folder(const std::string& name) {
    constexpr std::array<std::string_view, 6> kSkipped{"build",  "out",  ".git",
                                                       "corpus", "data", "__pycache__"};
    return std::find(kSkipped.begin(), kSkipped.end(), name) != kSkipped.end();
}

void load_folder(const fs::path& root, const fs::path& folder, SourceTree& tree) {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        if (entry.is_directory() && !entry.is_symlink()) {
            if (!is_skipped_folder(entry.path().filename().string())) load_folder(root, entry.path(), tree);
        } else if (entry.is_regular_file() && is_text(entry.path())) {
            std::ifstream file(entry.path(), std::ios::binary);
            tree.add(fs::relative(entry.path(), root).generic_string(),
                     std::string(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()));
        }
    }
}

}  // namespace

std::vector<std::string_view> SourceFile::lines() const {
    std::vector<std::string_view> lines;
    std::string_view rest = text;
    while (!rest.empty()) {
        const std::size_t end = std::min(rest.find('\n'), rest.size());
        lines.push_back(rest.substr(0, end));
        rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    return lines;
}

SourceTree SourceTree::load(const fs::path& root) {
    SourceTree tree;
    load_folder(root, root, tree);
    return tree;
}

void SourceTree::add(std::string path, std::string text) {
    SourceFile& file = files_[path];
    file.path = std::move(path);
    file.text = std::move(text);
    if (file.is_cpp()) file.code = lex(file.text);
}

const SourceFile* SourceTree::find(std::string_view path) const {
    const auto found = files_.find(path);
    return found == files_.end() ? nullptr : &found->second;
}

bool SourceTree::has_folder(std::string_view folder) const {
    return std::any_of(files_.begin(), files_.end(),
                       [&](const auto& entry) { return entry.second.is_under(folder); });
}

}  // namespace rig::hygiene
