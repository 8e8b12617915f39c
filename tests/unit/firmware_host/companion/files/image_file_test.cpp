#include "firmware_host/companion/files/image_file.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <span>
#include <string>

#include "firmware_host/companion/files/whole_file.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::host {
namespace {

GreyImage gradient(int width_px, int height_px) {
    GreyImage image{.width_px = width_px, .height_px = height_px, .pixels = {}};
    for (int y = 0; y < height_px; ++y) {
        for (int x = 0; x < width_px; ++x)
            image.pixels.push_back(static_cast<std::uint8_t>((7 * x + 13 * y) % 251));
    }
    return image;
}

std::string encoded(const std::string& extension) {
    const GreyImage image = gradient(33, 21);
    const cv::Mat mat(image.height_px, image.width_px, CV_8UC1,
                      const_cast<std::uint8_t*>(image.pixels.data()));
    std::vector<std::uint8_t> bytes;
    cv::imencode(extension, mat, bytes);
    return {bytes.begin(), bytes.end()};
}

Result<GreyImage, FileError> parse(const std::string& bytes, const std::string& name) {
    return parse_grey_image(std::as_bytes(std::span{bytes.data(), bytes.size()}), name);
}

class LosslessImage : public testing::TestWithParam<const char*> {};

TEST_P(LosslessImage, ReadsWhatItWrites) {
    const rig::test::TempFolder folder;
    const GreyImage image = gradient(37, 23);
    ASSERT_TRUE(write_grey_image(folder / GetParam(), image.view()));
    const auto back = read_grey_image(folder / GetParam());
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->width_px, 37);
    EXPECT_EQ(back->height_px, 23);
    EXPECT_EQ(back->pixels, image.pixels);
}

INSTANTIATE_TEST_SUITE_P(Formats, LosslessImage, testing::Values("a.png", "a.pgm"));

TEST(ImageFile, ViewsWithAStrideAreWrittenRowByRow) {
    const rig::test::TempFolder folder;
    const GreyImage image = gradient(40, 20);
    const ImageView left{.pixels = image.pixels.data(), .width_px = 10, .height_px = 20, .stride_bytes = 40};
    ASSERT_TRUE(write_grey_image(folder / "left.png", left));
    const auto back = read_grey_image(folder / "left.png");
    ASSERT_TRUE(back);
    EXPECT_EQ(back->width_px, 10);
    EXPECT_EQ(back->pixels[10 * 5 + 3], image.pixels[40 * 5 + 3]);
}

TEST(ImageFile, JpegIsReadAndColourBecomesGrey) {
    const auto jpeg = parse(encoded(".jpg"), "a.jpg");
    ASSERT_TRUE(jpeg) << jpeg.error().message;
    EXPECT_EQ(jpeg->width_px, 33);
    const auto colour = parse(std::string{"P6\n2 1\n255\n"} + "\xFF\xFF\xFF" + std::string(3, '\0'), "c.ppm");
    ASSERT_TRUE(colour) << colour.error().message;
    EXPECT_EQ(colour->pixels, (std::vector<std::uint8_t>{255, 0}));
}

TEST(ImageFile, PgmHeadersMayHoldComments) {
    const auto image = parse("P5 # made by hand\n# two\n2 1\n255\nAB", "c.pgm");
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ(image->pixels, (std::vector<std::uint8_t>{'A', 'B'}));
}

class CutImage : public testing::TestWithParam<const char*> {};

TEST_P(CutImage, EveryTruncationIsRefusedByName) {
    const std::string whole = encoded(GetParam());
    ASSERT_TRUE(parse(whole, "whole"));
    for (std::size_t size = 0; size < whole.size(); size += 1 + size / 97) {
        const auto result = parse(whole.substr(0, size), "cut_image");
        ASSERT_FALSE(result) << size << " of " << whole.size();
        EXPECT_NE(result.error().message.find("cut_image"), std::string::npos);
    }
    EXPECT_FALSE(parse(whole.substr(0, whole.size() - 1), "cut_image"));
}

INSTANTIATE_TEST_SUITE_P(Formats, CutImage, testing::Values(".png", ".jpg", ".pgm"));

TEST(ImageFile, WhatIsNoImageIsRefused) {
    for (const std::string& bytes :
         {std::string{"hello"}, std::string{"P5"}, std::string{"P5\n2 2\n255\n\1\2\3"},
          std::string{"P5\n0 2\n255\n"}, std::string{"P5\n99999999 99999999\n255\n"},
          std::string{"P5\n-2 2\n255\nabcd"}, std::string{"\xFF\xD8\xFF"}, std::string{"\x89PNG\r\n\x1A\n"},
          std::string{"BM123456"}}) {
        const auto result = parse(bytes, "bad_image");
        ASSERT_FALSE(result) << bytes;
        EXPECT_NE(result.error().message.find("bad_image"), std::string::npos);
    }
}

TEST(ImageFile, DamageInAPngIsNoticed) {
    std::string bytes = encoded(".png");
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x55);
    EXPECT_FALSE(parse(bytes, "damaged.png"));
}

TEST(ImageFile, MissingFileAndUnknownExtensionAreNamed) {
    const auto missing = read_grey_image("no/such.png");
    ASSERT_FALSE(missing);
    EXPECT_NE(missing.error().message.find("no/such.png"), std::string::npos);
    const GreyImage image = gradient(2, 2);
    EXPECT_FALSE(write_grey_image("a.bmp", image.view()));
    EXPECT_FALSE(write_grey_image("a.png", ImageView{}));
}

TEST(ImageFile, RgbKeepsItsChannelOrder) {
    const rig::test::TempFolder folder;
    ASSERT_TRUE(write_rgb_image(folder / "c.png", 1, 1, {255, 0, 0}));
    const cv::Mat bgr = cv::imread((folder / "c.png").string(), cv::IMREAD_COLOR);
    EXPECT_EQ(bgr.at<cv::Vec3b>(0, 0), cv::Vec3b(0, 0, 255));
    EXPECT_FALSE(write_rgb_image(folder / "d.png", 2, 1, {255, 0, 0}));
}

TEST(ImageFile, PicturesForPagesDecodeToWhatWasEncoded) {
    const std::vector<std::uint8_t> png = encode_rgba_png(2, 1, {255, 0, 0, 255, 1, 2, 3, 0});
    const cv::Mat bgra = cv::imdecode(png, cv::IMREAD_UNCHANGED);
    ASSERT_EQ(bgra.channels(), 4);
    EXPECT_EQ(bgra.at<cv::Vec4b>(0, 0), cv::Vec4b(0, 0, 255, 255));
    EXPECT_EQ(bgra.at<cv::Vec4b>(0, 1)[3], 0);
    const GreyImage image = gradient(64, 48);
    const std::vector<std::uint8_t> jpeg = encode_jpeg(image, 90);
    const auto back = parse_grey_image(std::as_bytes(std::span(jpeg)), "back.jpg");
    ASSERT_TRUE(back);
    ASSERT_EQ(back->pixels.size(), image.pixels.size());
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        ASSERT_NEAR(back->pixels[i], image.pixels[i], 16) << i;
}

}  // namespace
}  // namespace rig::host
