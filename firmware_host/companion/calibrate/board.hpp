// The flat target that cameras are calibrated with: what is printed on it, where its points are, and the
// picture to print. Not for finding it in pictures: board_detection.hpp.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "firmware_host/companion/files/file_error.hpp"
#include "firmware_host/companion/files/image_file.hpp"

namespace rig::host {

enum class BoardKind : std::uint8_t { kCharuco, kCircles };

// ChArUco: columns x rows squares, its points are the corners between four squares. Circles: rows of
// `columns` dots each, every second row shifted by half a step; the row count is odd, because otherwise the
// board looks the same upside down.
struct BoardSpec {
    BoardKind kind = BoardKind::kCharuco;
    int columns = 0;
    int rows = 0;
    double spacing_mm = 0.0;  // side of a square; between rows of circles (within a row twice that)
    double mark_mm = 0.0;     // side of a marker; diameter of a circle
    std::string dictionary = "5x5_100";  // ChArUco only
};

// Board frame: x right, y down as printed, z into the paper; origin at the outer corner of the first square,
// or one spacing left of and above the first circle.
struct BoardPoint {
    double x_mm = 0.0;
    double y_mm = 0.0;
};

// "charuco:COLUMNSxROWS:SQUARE_MM[:MARKER_MM[:DICTIONARY]]" or
// "circles:COLUMNSxROWS:SPACING_MM[:DIAMETER_MM]". Markers default to 0.7 of a square, diameters to 0.8 of
// the spacing. 3 to 40 columns and rows, 1 to 500 mm.
[[nodiscard]] Result<BoardSpec, FileError> parse_board(std::string_view text);
[[nodiscard]] std::string board_text(const BoardSpec& board);

// Point i is the one with the number i, row by row.
[[nodiscard]] std::vector<BoardPoint> board_points(const BoardSpec& board);
[[nodiscard]] double board_width_mm(const BoardSpec& board);
[[nodiscard]] double board_height_mm(const BoardSpec& board);

// The board alone, on white, edges on whole pixels: board coordinate x_mm lies at px_per_mm * (x_mm +
// margin_mm) - 0.5 px. Precondition: px_per_mm * margin_mm, * spacing_mm and * mark_mm are whole numbers for
// ChArUco.
[[nodiscard]] GreyImage draw_board(const BoardSpec& board, double px_per_mm, double margin_mm);

// A PNG to print: the board, a line of 100 mm (50, 20 or 10 on a smaller board) and words to check the print
// with, and the resolution in the file, so that 100 % is the right size.
struct PrintedSize {
    double width_mm = 0.0;
    double height_mm = 0.0;
    double px_per_mm = 0.0;
    double line_mm = 0.0;
};
[[nodiscard]] Result<PrintedSize, FileError> write_printable_board(const std::filesystem::path& path,
                                                                   const BoardSpec& board);

// The OpenCV dictionary of a name; -1 when there is none.
[[nodiscard]] int dictionary_number(std::string_view name);

}  // namespace rig::host
