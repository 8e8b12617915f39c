#include "firmware_host/companion/train/error_chart.hpp"

#include <gtest/gtest.h>

#include "firmware_host/companion/files/image_file.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::host {
namespace {

TEST(ErrorChart, DrawsEveryLineInsideThePicture) {
    const test::TempFolder folder;
    const std::vector<ErrorLine> lines{{"falls", {0, 0, 200}, {4, 6, 8, 24}, {2.0, 1.0, 0.5, 0.1}},
                                       {"dot", {200, 0, 0}, {17}, {1.5}}};
    const auto drawn = draw_errors(folder / "error.png", lines, "title", "count", "mm");
    ASSERT_TRUE(drawn.has_value()) << drawn.error().message;
    const auto picture = read_grey_image(folder / "error.png");
    ASSERT_TRUE(picture.has_value());
    std::size_t dark = 0;
    for (const std::uint8_t pixel : picture->pixels) dark += pixel < 128 ? 1 : 0;
    EXPECT_GT(dark, 1500U);
    EXPECT_LT(dark, picture->pixels.size() / 10);
}

TEST(ErrorChart, TakesNothingAndZeros) {
    const test::TempFolder folder;
    EXPECT_TRUE(draw_errors(folder / "a.png", {{"flat", {}, {4, 6}, {0.0, 0.0}}}, "", "", "").has_value());
    EXPECT_FALSE(draw_errors(folder / "none" / "a.png", {{"flat", {}, {4}, {1.0}}}, "", "", "").has_value());
}

}  // namespace
}  // namespace rig::host
