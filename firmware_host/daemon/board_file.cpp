#include "firmware_host/daemon/board_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <string_view>

#include "core/limits.hpp"
#include "firmware_host/daemon/board_fields.hpp"
#include "firmware_host/settings/filter_table.hpp"

namespace rig {

namespace {

constexpr std::uintmax_t kLargestBoardFile = 1 << 20;

std::unexpected<BoardFileError> refuse(const std::filesystem::path& file, const std::string& fault) {
    return failure(BoardFileError{fmt::format("{}: {}", file.string(), fault)});
}

void read_controls(BoardFields& fields, BoardVideo& video) {
    const toml::node* node = fields.take("controls");
    if (node == nullptr) return;
    const toml::table* table = node->as_table();
    if (table == nullptr) return fields.refuse(*node, "'controls' must be a table, { \"0x009a0901\" = 1 }");
    for (const auto& [key, value] : *table) {
        const std::string_view digits = key.str();
        std::uint32_t id = 0;
        const bool hex = digits.starts_with("0x");
        const char* end = digits.data() + digits.size();
        const auto parsed = std::from_chars(digits.data() + (hex ? 2 : 0), end, id, hex ? 16 : 10);
        const auto number = value.value_exact<std::int64_t>();
        const bool fits = number && *number >= INT32_MIN && *number <= INT32_MAX;
        if (parsed.ec != std::errc() || parsed.ptr != end || !fits) {
            return fields.refuse(value, fmt::format("control '{}' must be the number of a V4L2 control and a "
                                                    "whole number to set it to",
                                                    digits));
        }
        video.controls.emplace_back(id, static_cast<std::int32_t>(*number));
    }
}

void read_video(BoardFields& fields, BoardVideo& video) {
    fields.text("serial", video.serial, 1, 63);
    fields.whole("width_px", video.width_px, 16, 4096);
    fields.whole("height_px", video.height_px, 16, 4096);
    fields.text("pixels", video.pixels, 1, 8);
    constexpr std::array<std::string_view, 5> kKnown{"auto", "GREY", "Y16", "YUYV", "MJPEG"};
    if (std::ranges::find(kKnown, video.pixels) == kKnown.end())
        fields.refuse(*fields.take("pixels"), "'pixels' must be auto, GREY, Y16, YUYV or MJPEG");
    fields.number("gain_unit_db", video.gain_unit_db, 1e-4, 20.0);
    fields.number("gain_unity", video.gain_unity, 1e-3, 1e6);
    fields.whole("readout_us", video.readout_us, 0, 100'000);
    read_controls(fields, video);
}

void read_more(BoardFields& fields, BoardCamera& camera) {
    if (camera.source.starts_with("v4l2:")) read_video(fields, camera.video);
}
void read_more(BoardFields&, BoardLine&) {}

template <class Entry>
void read_named(BoardFields& fields, const char* what, std::vector<Entry>& into) {
    const toml::node* list = fields.take(what);
    if (list == nullptr) return;
    const toml::array* entries = list->as_array();
    if (entries == nullptr || !entries->is_homogeneous(toml::node_type::table))
        return fields.refuse(*list, fmt::format("'{}' must be a list of tables, [[{}]]", what, what));
    for (const toml::node& node : *entries) {
        Entry entry;
        const toml::table& table = *node.as_table();
        const std::string called = table["name"].value_or(std::string());
        BoardFields own(table, fmt::format("[[{}]]{}: ", what, called.empty() ? "" : " '" + called + "'"));
        own.text("name", entry.name, 1, 32);
        own.text("source", entry.source, 1, 128);
        if (entry.name.empty() || entry.source.empty()) own.refuse(node, "needs a name and a source");
        read_more(own, entry);
        own.nothing_else();
        for (const Entry& other : into) {
            if (other.name == entry.name) own.refuse(node, fmt::format("two [[{}]] have this name", what));
        }
        fields.pass_on(own.fault());
        into.push_back(std::move(entry));
    }
}

void read_smoothing(BoardFields& fields, Board& board) {
    const toml::node* node = fields.take("smoothing");
    if (node == nullptr) return;
    const toml::table* table = node->as_table();
    if (table == nullptr) return fields.refuse(*node, "'smoothing' must be a table");
    const std::string fault = read_filter_settings(*table, board.smoothing);
    if (!fault.empty()) fields.refuse(*node, "[smoothing]: " + fault);
}

std::string read_table(const toml::table& table, Board& board) {
    BoardFields fields(table, "");
    fields.text("name", board.name, 1, 24);
    fields.number("rate_hz", board.rate_hz, 1.0, 1000.0);
    fields.whole("frozen_frames", board.frozen_frames, 0, 1000);
    if (board.frozen_frames == 1)
        fields.refuse(*fields.take("frozen_frames"), "'frozen_frames' must be 0 (never) or 2 to 1000");
    fields.text("default_link", board.default_link, 0, 256);
    read_named(fields, "camera", board.cameras);
    read_named(fields, "line", board.lines);
    read_smoothing(fields, board);
    fields.nothing_else();
    if (fields.fault().empty() && board.name.empty()) return "'name' must have 1 to 24 bytes, in quotes";
    if (fields.fault().empty() && board.cameras.size() > kMaxCameras)
        return fmt::format("there are {} cameras; at most {} are possible", board.cameras.size(),
                           kMaxCameras);
    return fields.fault();
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
