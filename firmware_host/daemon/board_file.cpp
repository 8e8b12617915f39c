#include "firmware_host/daemon/board_file.hpp"

#include <fmt/format.h>

#include <set>
#include <sstream>

#include "core/limits.hpp"
#include "firmware_host/settings/filter_table.hpp"

namespace rig {

namespace {

constexpr std::uintmax_t kLargestBoardFile = 1 << 20;

std::unexpected<BoardFileError> refuse(const std::filesystem::path& file, const std::string& fault) {
    return failure(BoardFileError{fmt::format("{}: {}", file.string(), fault)});
}

// "" when all keys of the table are known.
std::string unknown_key(const toml::table& table, const std::set<std::string>& known) {
    for (const auto& [key, value] : table) {
        if (!known.contains(std::string(key.str()))) return std::string(key.str());
    }
    return "";
}

template <class Entry>
std::string read_named(const toml::node_view<const toml::node>& list, const char* what,
                       std::vector<Entry>& into) {
    if (!list) return "";
    const toml::array* entries = list.as_array();
    if (entries == nullptr) return fmt::format("'{}' must be a list of tables, [[{}]]", what, what);
    for (const toml::node& node : *entries) {
        const toml::table* table = node.as_table();
        if (table == nullptr) return fmt::format("'{}' must be a list of tables, [[{}]]", what, what);
        Entry entry;
        entry.name = (*table)["name"].value_or(std::string());
        entry.source = (*table)["source"].value_or(std::string());
        if (entry.name.empty() || entry.source.empty())
            return fmt::format("each [[{}]] needs a name and a source", what);
        if (const auto key = unknown_key(*table, {"name", "source"}); !key.empty()) {
            return fmt::format("[[{}]] has no key '{}'", what, key);
        }
        for (const Entry& other : into) {
            if (other.name == entry.name) return fmt::format("two [[{}]] are called '{}'", what, entry.name);
        }
        into.push_back(std::move(entry));
    }
    return "";
}

std::string read_table(const toml::table& table, Board& board) {
    const auto key = unknown_key(
        table, {"name", "rate_hz", "frozen_frames", "default_link", "camera", "line", "smoothing"});
    if (!key.empty()) return fmt::format("there is no key '{}'", key);
    board.name = table["name"].value_or(std::string());
    if (board.name.empty() || board.name.size() > 24) return "'name' must have 1 to 24 bytes";
    board.rate_hz = table["rate_hz"].value_or(60.0);
    if (!(board.rate_hz >= 1.0 && board.rate_hz <= 1000.0)) return "'rate_hz' must be 1 to 1000";
    const auto frozen = table["frozen_frames"].value_or(std::int64_t{3});
    if (frozen < 0 || frozen == 1 || frozen > 1000) return "'frozen_frames' must be 0 (never) or 2 to 1000";
    board.frozen_frames = static_cast<int>(frozen);
    board.default_link = table["default_link"].value_or(std::string());
    const toml::table& constant = table;
    std::string fault = read_named(constant["camera"], "camera", board.cameras);
    if (fault.empty()) fault = read_named(constant["line"], "line", board.lines);
    if (fault.empty() && board.cameras.size() > kMaxCameras) {
        fault =
            fmt::format("there are {} cameras; at most {} are possible", board.cameras.size(), kMaxCameras);
    }
    if (fault.empty() && constant["smoothing"]) {
        const toml::table* smoothing = constant["smoothing"].as_table();
        fault = smoothing == nullptr ? "'smoothing' must be a table"
                                     : read_filter_settings(*smoothing, board.smoothing);
        if (!fault.empty()) fault = "[smoothing]: " + fault;
    }
    return fault;
}

}  // namespace

const BoardLine* Board::line(const std::string& wanted) const {
    for (const BoardLine& each : lines) {
        if (each.name == wanted) return &each;
    }
    return nullptr;
}

Result<Board, BoardFileError> load_board(const std::string& name, const std::filesystem::path& folder) {
    const bool is_path = name.find('/') != std::string::npos || name.ends_with(".toml");
    const std::filesystem::path file = is_path ? std::filesystem::path(name) : folder / name / "board.toml";
    std::error_code fault;
    const auto size = std::filesystem::file_size(file, fault);
    if (fault)
        return refuse(file, fmt::format("{}; boards are folders of {}", fault.message(), folder.string()));
    if (size > kLargestBoardFile) return refuse(file, "is over 1 MiB and no board file");
    const toml::parse_result parsed = toml::parse_file(file.string());
    if (!parsed) {
        const auto& error = parsed.error();
        return refuse(
            file, fmt::format("line {}: {}", error.source().begin.line, std::string(error.description())));
    }
    Board board;
    if (const std::string wrong = read_table(parsed.table(), board); !wrong.empty())
        return refuse(file, wrong);
    return board;
}

}  // namespace rig
