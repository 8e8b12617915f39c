#include "firmware_host/companion/capture/picture_stream.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <opencv2/videoio.hpp>

#include "tests/support/temp_folder.hpp"
#include "tests/support/text_checks.hpp"

namespace rig::host {
namespace {

using test::has;

class PictureStreams : public testing::Test {
  protected:
    void write(const std::string& name, std::uint8_t grey) {
        const GreyImage image{32, 24, std::vector<std::uint8_t>(32 * 24, grey)};
        ASSERT_TRUE(write_grey_image(folder / name, image.view()).has_value());
    }
    [[nodiscard]] static std::string fault_of(const std::string& source) {
        const auto opened = open_picture_stream(source);
        EXPECT_FALSE(opened.has_value());
        return opened ? "" : opened.error().message;
    }
    test::TempFolder folder;
};

TEST_F(PictureStreams, AFolderPlaysByTheNumbersInItsNames) {
    write("shot_0007.png", 70);
    write("shot_0009.png", 90);
    write("shot_0010.png", 100);
    const auto stream = open_picture_stream(folder.path().string());
    ASSERT_TRUE(stream.has_value()) << stream.error().message;
    std::int64_t time_us = 0;
    std::vector<std::int64_t> times_us;
    std::vector<int> greys;
    for (auto next = (*stream)->picture_after(time_us, 0); next;
         next = (*stream)->picture_after(time_us, 0)) {
        time_us = next->time_us;
        times_us.push_back(time_us);
        greys.push_back(next->image.pixels[5]);
    }
    EXPECT_EQ(times_us, (std::vector<std::int64_t>{800'000, 1'000'000, 1'100'000}));
    EXPECT_EQ(greys, (std::vector<int>{70, 90, 100}));
    const auto end = (*stream)->picture_after(time_us, 0);
    EXPECT_EQ(end.error(), StreamEnd::kEnded);
    EXPECT_TRUE((*stream)->fault().empty());
}

TEST_F(PictureStreams, AFolderWithoutNumbersPlaysInOrder) {
    write("one.png", 10);
    write("two.png", 20);
    const auto stream = open_picture_stream(folder.path().string());
    ASSERT_TRUE(stream.has_value());
    EXPECT_EQ((*stream)->picture_after(0, 0)->time_us, 100'000);
    EXPECT_EQ((*stream)->picture_after(100'000, 0)->image.pixels[0], 20);
}

TEST_F(PictureStreams, APictureThatCannotBeReadEndsItWithItsName) {
    write("1.png", 10);
    std::ofstream(folder / "2.png") << "no picture";
    const auto stream = open_picture_stream(folder.path().string());
    ASSERT_TRUE(stream.has_value());
    ASSERT_TRUE((*stream)->picture_after(0, 0).has_value());
    for (int i = 0; i < 2; ++i) {
        const auto next = (*stream)->picture_after(200'000, 0);
        ASSERT_FALSE(next.has_value());
        EXPECT_EQ(next.error(), StreamEnd::kGone);
    }
    EXPECT_TRUE(has((*stream)->fault(), "2.png")) << (*stream)->fault();
}

TEST_F(PictureStreams, AFilmPlaysAtItsRate) {
    const std::string path = (folder / "film.avi").string();
    {
        cv::VideoWriter film(path, cv::CAP_OPENCV_MJPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 20.0,
                             {64, 48});
        ASSERT_TRUE(film.isOpened());
        for (const int grey : {40, 120, 200}) film.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(grey)));
    }
    const auto stream = open_picture_stream(path);
    ASSERT_TRUE(stream.has_value()) << stream.error().message;
    const auto first = (*stream)->picture_after(0, 0);
    ASSERT_TRUE(first.has_value());
    EXPECT_EQ(first->time_us, 50'000);
    EXPECT_EQ(first->image.width_px, 64);
    EXPECT_NEAR(first->image.pixels[100], 40, 3);
    const auto third = (*stream)->picture_after(100'000, 0);
    ASSERT_TRUE(third.has_value());
    EXPECT_NEAR(third->image.pixels[100], 200, 3);
    EXPECT_EQ((*stream)->picture_after(150'000, 0).error(), StreamEnd::kEnded);
}

TEST_F(PictureStreams, WhatIsNotThereIsSaidWithTheRemedy) {
    EXPECT_TRUE(has(fault_of("/dev/video99"), "there is no such device")) << fault_of("/dev/video99");
    EXPECT_EQ(fault_of("99"), fault_of("/dev/video99"));
    EXPECT_TRUE(has(fault_of((folder / "nothing").string()), "neither a device")) << fault_of("nothing");
    EXPECT_TRUE(has(fault_of(folder.path().string()), "has no .png")) << fault_of(folder.path().string());
    std::ofstream(folder / "text.avi") << "words";
    EXPECT_TRUE(has(fault_of((folder / "text.avi").string()), "is no film")) << fault_of("text.avi");
    EXPECT_TRUE(has(fault_of("/dev/null"), "gives no pictures")) << fault_of("/dev/null");
}

}  // namespace
}  // namespace rig::host
