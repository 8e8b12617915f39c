#include "firmware_host/companion/calibrate/board.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "firmware_host/companion/calibrate/board_detection.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::host {
namespace {

TEST(ParseBoard, TakesWhatItPrints) {
    for (const char* text : {"charuco:9x7:12:8:5x5_100", "circles:4x11:8:6", "charuco:5x4:30:15:4x4_50"}) {
        const auto board = parse_board(text);
        ASSERT_TRUE(board.has_value()) << board.error().message;
        EXPECT_EQ(board_text(*board), text);
    }
    EXPECT_EQ(board_text(*parse_board("charuco:9x7:12")), "charuco:9x7:12:8.4:5x5_100");
    EXPECT_EQ(board_text(*parse_board("circles:4x11:8")), "circles:4x11:8:6.4");
}

TEST(ParseBoard, SaysWhatIsWrongAndHowItIsWritten) {
    const auto fault = [](const char* text) {
        const auto board = parse_board(text);
        EXPECT_FALSE(board.has_value()) << text;
        const std::string message = board ? "" : board.error().message;
        EXPECT_NE(message.find("charuco:9x7:10"), std::string::npos) << message;
        return message;
    };
    for (const char* text :
         {"", "chess:9x7:12", "charuco", "charuco:9:12", "charuco:9x7", "charuco:9x7:12:8:5x5_100:1",
          "charuco:9x7:nan", "charuco:9x7:-12", "charuco:9x7:0", "charuco:2x7:12", "charuco:9x99:12",
          "charuco:9x7:12mm", "circles:4x11:8:6:5x5_100"}) {
        (void)fault(text);
    }
    EXPECT_NE(fault("circles:4x10:8").find("upside down"), std::string::npos);
    EXPECT_NE(fault("circles:4x11:8:20").find("touch"), std::string::npos);
    EXPECT_NE(fault("charuco:9x7:12:12").find("smaller than squares"), std::string::npos);
    EXPECT_NE(fault("charuco:9x7:12:8:9x9_50").find("unknown dictionary"), std::string::npos);
    EXPECT_NE(fault("charuco:30x30:12:8:4x4_50").find("450 markers"), std::string::npos);
}

// The drawing and the list of points agree: each is found where it was drawn.
TEST(DrawBoard, PointsAreWhereTheListHasThem) {
    for (const char* text :
         {"charuco:9x7:10:7", "charuco:8x6:10:7", "charuco:6x9:10:6", "circles:4x11:8", "circles:5x7:9"}) {
        const BoardSpec board = *parse_board(text);
        constexpr double kPxPerMm = 8.0;
        constexpr double kMarginMm = 5.0;
        const GreyImage drawn = draw_board(board, kPxPerMm, kMarginMm);
        const BoardSighting found = find_board(drawn.view(), board);
        const std::vector<BoardPoint> points = board_points(board);
        ASSERT_TRUE(found.fault.empty()) << text << ": " << found.fault;
        ASSERT_EQ(found.points.size(), points.size()) << text;
        for (std::size_t i = 0; i < points.size(); ++i) {
            EXPECT_EQ(found.points[i], i);
            EXPECT_NEAR(found.x_px[i], kPxPerMm * (points[i].x_mm + kMarginMm) - 0.5, 0.03)
                << text << " " << i;
            EXPECT_NEAR(found.y_px[i], kPxPerMm * (points[i].y_mm + kMarginMm) - 0.5, 0.03)
                << text << " " << i;
        }
    }
}

std::uint32_t big_endian(const std::string& bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8U | static_cast<std::uint8_t>(bytes[at + i]);
    return value;
}

TEST(WritePrintableBoard, CarriesItsResolutionAndIsTheBoard) {
    const test::TempFolder folder;
    const std::filesystem::path path = folder.path() / "board.png";
    const BoardSpec board = *parse_board("charuco:9x7:12");
    const auto printed = write_printable_board(path, board);
    ASSERT_TRUE(printed.has_value()) << printed.error().message;
    EXPECT_NEAR(printed->width_mm, 9 * 12 + 20, 0.1);
    EXPECT_NEAR(printed->height_mm, 7 * 12 + 20, 0.1);
    std::ifstream in(path, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    const std::size_t chunk = bytes.find("pHYs");
    ASSERT_NE(chunk, std::string::npos);
    EXPECT_EQ(big_endian(bytes, chunk + 4), static_cast<std::uint32_t>(1000.0 * printed->px_per_mm + 0.5));
    const auto image = read_grey_image(path);
    ASSERT_TRUE(image.has_value()) << image.error().message;
    EXPECT_EQ(find_board(image->view(), board).points.size(), board_points(board).size());
    EXPECT_EQ(printed->line_mm, 100.0);
    EXPECT_FALSE(write_printable_board(folder.path() / "no" / "board.png", board).has_value());
    EXPECT_FALSE(write_printable_board(folder.path() / "board.jpg", board).has_value());
}

TEST(FindBoard, SaysWhyThereIsNone) {
    const BoardSpec board = *parse_board("charuco:9x7:10:7");
    const std::vector<std::uint8_t> grey(640 * 480, 128);
    EXPECT_NE(find_board({grey.data(), 640, 480, 640}, board).fault.find("no marker"), std::string::npos);
    EXPECT_NE(
        find_board({grey.data(), 640, 480, 640}, *parse_board("circles:4x11:8")).fault.find("44 circles"),
        std::string::npos);
    const GreyImage larger = draw_board(*parse_board("charuco:12x9:10:7"), 8.0, 5.0);
    EXPECT_NE(find_board(larger.view(), board).fault.find("the board's are 0 to 30"), std::string::npos);
}

// On a board of less than 100 mm the line is shorter; it and its words stay inside the margin under the
// board.
TEST(WritePrintableBoard, HasALineThatThePageHasRoomFor) {
    const test::TempFolder folder;
    const std::filesystem::path path = folder.path() / "board.png";
    const BoardSpec board = *parse_board("circles:4x11:8");
    const auto printed = write_printable_board(path, board);
    ASSERT_TRUE(printed.has_value()) << printed.error().message;
    EXPECT_EQ(printed->line_mm, 50.0);
    const auto image = read_grey_image(path);
    ASSERT_TRUE(image.has_value()) << image.error().message;
    const auto dark = [&](int x, int y) {
        return image->pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(image->width_px) +
                             static_cast<std::size_t>(x)] < 128;
    };
    const int margin = static_cast<int>(10.0 * printed->px_per_mm);
    int longest = 0;
    for (int y = image->height_px - margin; y < image->height_px; ++y) {
        for (int x = 0, run = 0; x < image->width_px; ++x) {
            run = dark(x, y) ? run + 1 : 0;
            longest = std::max(longest, run);
            if (dark(x, y)) {
                EXPECT_GE(x, margin - 4);
                EXPECT_LE(x, image->width_px - margin + 4);
            }
        }
    }
    EXPECT_NEAR(longest / printed->px_per_mm, 50.0, 0.3);
    // as a camera would see it: a printed circle is 150 px wide, beyond what detection looks for
    GreyImage small{image->width_px / 6, image->height_px / 6, {}};
    for (int y = 0; y < small.height_px; ++y) {
        for (int x = 0; x < small.width_px; ++x) {
            int sum = 0;
            for (int i = 0; i < 36; ++i)
                sum +=
                    image
                        ->pixels[static_cast<std::size_t>((6 * y + i / 6) * image->width_px + 6 * x + i % 6)];
            small.pixels.push_back(static_cast<std::uint8_t>(sum / 36));
        }
    }
    EXPECT_EQ(find_board(small.view(), board).points.size(), board_points(board).size());
}

}  // namespace
}  // namespace rig::host
