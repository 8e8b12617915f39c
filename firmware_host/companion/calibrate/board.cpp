#include "firmware_host/companion/calibrate/board.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <opencv2/aruco.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace rig::host {

namespace {

constexpr double kMarkerShare = 0.7;    // of a square: wide enough to read, narrow enough to leave edges bare
constexpr double kDiameterShare = 0.8;  // of the spacing: 0.4 spacings of white remain between circles
constexpr double kPrintedMarginMm = 10.0;

struct DictionaryName {
    std::string_view name;
    int number;
};
constexpr std::array kDictionaries{
    DictionaryName{"4x4_50", cv::aruco::DICT_4X4_50},   DictionaryName{"4x4_100", cv::aruco::DICT_4X4_100},
    DictionaryName{"4x4_250", cv::aruco::DICT_4X4_250}, DictionaryName{"5x5_50", cv::aruco::DICT_5X5_50},
    DictionaryName{"5x5_100", cv::aruco::DICT_5X5_100}, DictionaryName{"5x5_250", cv::aruco::DICT_5X5_250},
    DictionaryName{"6x6_50", cv::aruco::DICT_6X6_50},   DictionaryName{"6x6_100", cv::aruco::DICT_6X6_100},
    DictionaryName{"6x6_250", cv::aruco::DICT_6X6_250}};

std::vector<std::string_view> split(std::string_view text, char separator) {
    std::vector<std::string_view> parts;
    for (;;) {
        const std::size_t end = text.find(separator);
        parts.push_back(text.substr(0, end));
        if (end == std::string_view::npos) return parts;
        text.remove_prefix(end + 1);
    }
}

template <class T>
std::optional<T> number_in(std::string_view text, T low, T high) {
    T value{};
    const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (fault != std::errc{} || end != text.data() + text.size() || !(value >= low) || !(value <= high))
        return std::nullopt;
    return value;
}

std::unexpected<FileError> wrong(std::string_view text, std::string_view why) {
    return failure(FileError{
        fmt::format("--board {}: {}; write charuco:COLUMNSxROWS:SQUARE_MM[:MARKER_MM[:DICTIONARY]], e.g. "
                    "charuco:9x7:10, or circles:COLUMNSxROWS:SPACING_MM[:DIAMETER_MM], e.g. circles:4x11:10",
                    printable(text), why)});
}

// Why this board cannot be used; empty when it can.
std::string fault_of(const BoardSpec& board) {
    if (board.kind == BoardKind::kCircles) {
        if (board.rows % 2 == 0)
            return "with an even number of rows it looks the same upside down; use an odd one";
        if (!(board.mark_mm < 1.2 * board.spacing_mm)) return "circles of this diameter touch each other";
        return {};
    }
    if (!(board.mark_mm < board.spacing_mm)) return "markers must be smaller than squares";
    const int number = dictionary_number(board.dictionary);
    if (number < 0) return "unknown dictionary; use one of 4x4, 5x5, 6x6 with _50, _100 or _250";
    const int held = cv::aruco::getPredefinedDictionary(number)->bytesList.rows;
    if (board.columns * board.rows / 2 > held)
        return fmt::format("it needs {} markers and the dictionary has {}", board.columns * board.rows / 2,
                           held);
    return {};
}

std::uint32_t crc32(std::string_view bytes) {
    std::uint32_t crc = 0xffffffffU;
    for (const char byte : bytes) {
        crc ^= static_cast<std::uint8_t>(byte);
        for (int bit = 0; bit < 8; ++bit) crc = crc >> 1U ^ ((crc & 1U) != 0 ? 0xedb88320U : 0U);
    }
    return ~crc;
}

void append_big_endian(std::string& bytes, std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8)
        bytes += static_cast<char>(value >> static_cast<unsigned>(shift));
}

// A PNG with its resolution: the chunk pHYs behind IHDR, which ends 33 bytes into every PNG.
std::string with_resolution(const std::vector<std::uint8_t>& png, double px_per_mm) {
    constexpr std::size_t kHeaderEnd = 33;
    std::string body = "pHYs";
    for (int axis = 0; axis < 2; ++axis)
        append_big_endian(body, static_cast<std::uint32_t>(std::lround(1000.0 * px_per_mm)));
    body += '\1';  // pixels a metre
    std::string out(png.begin(), png.begin() + kHeaderEnd);
    append_big_endian(out, static_cast<std::uint32_t>(body.size() - 4));
    out += body;
    append_big_endian(out, crc32(body));
    out.append(png.begin() + kHeaderEnd, png.end());
    return out;
}

// Markers are numbered row by row; the first square is black.
void draw_charuco(const BoardSpec& board, double px_per_mm, cv::Mat& picture) {
    const auto dictionary = cv::aruco::getPredefinedDictionary(dictionary_number(board.dictionary));
    const auto square = static_cast<int>(std::lround(board.spacing_mm * px_per_mm));
    const auto side = static_cast<int>(std::lround(board.mark_mm * px_per_mm));
    int number = 0;
    for (int y = 0; y < board.rows; ++y) {
        for (int x = 0; x < board.columns; ++x) {
            cv::Mat place = picture(cv::Rect(x * square, y * square, square, square));
            if ((x + y) % 2 == 0) {
                place.setTo(0);
                continue;
            }
            cv::Mat marker;
            dictionary->drawMarker(number++, side, marker, 1);
            const int gap = (square - side) / 2;
            marker.copyTo(place(cv::Rect(gap, gap, side, side)));
        }
    }
}

void draw_circles(const BoardSpec& board, double px_per_mm, cv::Mat& picture) {
    constexpr int kShift = 8;  // OpenCV draws at 256ths of a pixel
    const auto fixed = [](double px) { return cvRound(px * (1 << kShift)); };
    for (const BoardPoint& point : board_points(board)) {
        const cv::Point centre(fixed(px_per_mm * point.x_mm - 0.5), fixed(px_per_mm * point.y_mm - 0.5));
        cv::circle(picture, centre, fixed(0.5 * board.mark_mm * px_per_mm), cv::Scalar(0), cv::FILLED,
                   cv::LINE_AA, kShift);
    }
}

// The longest round line that the page has room for.
double check_line_mm(double room_mm) {
    for (const double length_mm : {100.0, 50.0, 20.0}) {
        if (length_mm <= room_mm) return length_mm;
    }
    return 10.0;
}

// Line and words in the margin under the board, a quarter of the margin away from it: marks want white around
// them. Words as wide as the board at most.
void draw_check_line(const std::string& words, double line_mm, double px_per_mm, double margin_mm,
                     cv::Mat& page) {
    const int left = cvRound(px_per_mm * margin_mm);
    const int y = page.rows - cvRound(px_per_mm * 0.6 * margin_mm);
    const int end = left + cvRound(px_per_mm * line_mm);
    const int tick = cvRound(px_per_mm * 0.1 * margin_mm);
    const int thick = std::max(1, cvRound(px_per_mm * 0.15));
    cv::line(page, {left, y}, {end, y}, cv::Scalar(0), thick);
    for (const int x : {left, end}) cv::line(page, {x, y - tick}, {x, y + tick}, cv::Scalar(0), thick);
    int below = 0;
    double size = px_per_mm * 0.08;
    const int width = cv::getTextSize(words, cv::FONT_HERSHEY_SIMPLEX, size, thick, &below).width;
    size *= std::min(1.0, static_cast<double>(page.cols - 2 * left) / std::max(1, width));
    cv::putText(page, words, {left, page.rows - cvRound(px_per_mm * 0.15 * margin_mm)},
                cv::FONT_HERSHEY_SIMPLEX, size, cv::Scalar(0), thick, cv::LINE_AA);
}

// Pixels a millimetre, about 600 an inch, at which squares and markers are whole numbers of pixels.
double printing_resolution(const BoardSpec& board) {
    constexpr double kWished = 24.0;
    if (board.kind == BoardKind::kCircles) return kWished;
    // Sides given to a tenth of a millimetre are whole at 20 px/mm; finer ones are rounded to a pixel by
    // choosing the resolution for the square.
    return std::round(board.spacing_mm * kWished) / board.spacing_mm;
}

}  // namespace

int dictionary_number(std::string_view name) {
    const auto* const found =
        std::ranges::find_if(kDictionaries, [&](const DictionaryName& each) { return each.name == name; });
    return found == kDictionaries.end() ? -1 : found->number;
}

Result<BoardSpec, FileError> parse_board(std::string_view text) {
    const std::vector<std::string_view> parts = split(text, ':');
    BoardSpec board;
    if (parts[0] == "circles") {
        board.kind = BoardKind::kCircles;
    } else if (parts[0] != "charuco") {
        return wrong(text, "the board is neither charuco nor circles");
    }
    const std::size_t most = board.kind == BoardKind::kCharuco ? 5 : 4;
    if (parts.size() < 3 || parts.size() > most) return wrong(text, "parts are missing or too many");
    const std::vector<std::string_view> counts = split(parts[1], 'x');
    if (counts.size() != 2) return wrong(text, "the counts are not COLUMNSxROWS");
    const auto columns = number_in(counts[0], 3, 40);
    const auto rows = number_in(counts[1], 3, 40);
    if (!columns || !rows) return wrong(text, "columns and rows are 3 to 40 each");
    const auto spacing = number_in(parts[2], 1.0, 500.0);
    if (!spacing) return wrong(text, "the size is not 1 to 500 mm");
    board.columns = *columns;
    board.rows = *rows;
    board.spacing_mm = *spacing;
    board.mark_mm = *spacing * (board.kind == BoardKind::kCharuco ? kMarkerShare : kDiameterShare);
    if (parts.size() > 3) {
        const auto mark = number_in(parts[3], 0.1, 500.0);
        if (!mark) return wrong(text, "the size of a mark is not 0.1 to 500 mm");
        board.mark_mm = *mark;
    }
    if (parts.size() > 4) board.dictionary = parts[4];
    if (const std::string fault = fault_of(board); !fault.empty()) return wrong(text, fault);
    return board;
}

std::string board_text(const BoardSpec& board) {
    if (board.kind == BoardKind::kCircles)
        return fmt::format("circles:{}x{}:{:g}:{:g}", board.columns, board.rows, board.spacing_mm,
                           board.mark_mm);
    return fmt::format("charuco:{}x{}:{:g}:{:g}:{}", board.columns, board.rows, board.spacing_mm,
                       board.mark_mm, board.dictionary);
}

std::vector<BoardPoint> board_points(const BoardSpec& board) {
    std::vector<BoardPoint> points;
    if (board.kind == BoardKind::kCharuco) {
        for (int y = 1; y < board.rows; ++y) {
            for (int x = 1; x < board.columns; ++x)
                points.push_back({x * board.spacing_mm, y * board.spacing_mm});
        }
        return points;
    }
    for (int y = 0; y < board.rows; ++y) {
        for (int x = 0; x < board.columns; ++x)
            points.push_back({(1 + 2 * x + y % 2) * board.spacing_mm, (1 + y) * board.spacing_mm});
    }
    return points;
}

double board_width_mm(const BoardSpec& board) {
    return board.spacing_mm * (board.kind == BoardKind::kCharuco ? board.columns : 2 * board.columns + 1);
}

double board_height_mm(const BoardSpec& board) {
    return board.spacing_mm * (board.kind == BoardKind::kCharuco ? board.rows : board.rows + 1);
}

GreyImage draw_board(const BoardSpec& board, double px_per_mm, double margin_mm) {
    GreyImage image;
    image.width_px = cvRound(px_per_mm * (board_width_mm(board) + 2.0 * margin_mm));
    image.height_px = cvRound(px_per_mm * (board_height_mm(board) + 2.0 * margin_mm));
    image.pixels.assign(static_cast<std::size_t>(image.width_px) * static_cast<std::size_t>(image.height_px),
                        255);
    cv::Mat page(image.height_px, image.width_px, CV_8UC1, image.pixels.data());
    const int margin = cvRound(px_per_mm * margin_mm);
    cv::Mat inside = page(cv::Rect(margin, margin, page.cols - 2 * margin, page.rows - 2 * margin));
    if (board.kind == BoardKind::kCharuco) {
        draw_charuco(board, px_per_mm, inside);
    } else {
        draw_circles(board, px_per_mm, inside);
    }
    return image;
}

Result<PrintedSize, FileError> write_printable_board(const std::filesystem::path& path,
                                                     const BoardSpec& board) {
    if (path.extension() != ".png") return file_failure(path, "a board is written as .png");
    const double px_per_mm = printing_resolution(board);
    GreyImage image = draw_board(board, px_per_mm, kPrintedMarginMm);
    cv::Mat page(image.height_px, image.width_px, CV_8UC1, image.pixels.data());
    const double line_mm = check_line_mm(image.width_px / px_per_mm - 2.0 * kPrintedMarginMm);
    draw_check_line(fmt::format("{}  print at 100 %; this line is {:.0f} mm", board_text(board), line_mm),
                    line_mm, px_per_mm, kPrintedMarginMm, page);
    std::vector<std::uint8_t> png;
    if (!cv::imencode(".png", page, png)) return file_failure(path, "cannot be encoded");
    std::ofstream out(path, std::ios::binary | std::ios::trunc);
    out << with_resolution(png, px_per_mm);
    out.close();
    if (!out) return file_failure(path, "cannot be written; does the folder exist and is there space?");
    return PrintedSize{image.width_px / px_per_mm, image.height_px / px_per_mm, px_per_mm, line_mm};
}

}  // namespace rig::host
