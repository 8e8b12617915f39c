#include "firmware_host/companion/capture/live_cameras.hpp"

#include <gtest/gtest.h>

#include "tests/unit/firmware_host/companion/capture/board_views.hpp"

namespace rig::host {
namespace {

using test::blank_pictures;
using test::played_cameras;

TEST(LiveCameras, PicturesOfOneTimeGoTogetherInOrder) {
    LiveCameras cameras = played_cameras(
        {blank_pictures({100'000, 200'000, 300'000}), blank_pictures({110'000, 195'000, 305'000})});
    for (const std::int64_t first_us : {100'000, 200'000, 300'000}) {
        const auto moment = cameras.next(0);
        ASSERT_TRUE(moment.has_value());
        EXPECT_EQ(moment->pictures[0].time_us, first_us);
        EXPECT_LE(std::abs(moment->pictures[1].time_us - first_us), 10'000);
    }
    const auto end = cameras.next(0);
    ASSERT_FALSE(end.has_value());
    EXPECT_EQ(end.error().kind, StreamEnd::kEnded);
}

TEST(LiveCameras, PicturesWithoutPartnersArePassedOver) {
    LiveCameras cameras = played_cameras({blank_pictures({100'000, 200'000, 300'000, 400'000, 500'000}),
                                          blank_pictures({100'000, 400'000, 500'000})});
    for (const std::int64_t time_us : {100'000, 400'000, 500'000}) {
        const auto moment = cameras.next(0);
        ASSERT_TRUE(moment.has_value());
        for (const LivePicture& picture : moment->pictures) EXPECT_EQ(picture.time_us, time_us);
    }
}

TEST(LiveCameras, PicturesTooFarApartNeverMeet) {
    LiveCameras cameras =
        played_cameras({blank_pictures({100'000, 200'000}), blank_pictures({150'000, 250'000})});
    const auto end = cameras.next(0);
    ASSERT_FALSE(end.has_value());
    EXPECT_EQ(end.error().kind, StreamEnd::kEnded);
}

TEST(LiveCameras, TheCameraThatWentAwayIsNamed) {
    std::vector<std::unique_ptr<PictureStream>> streams;
    streams.push_back(std::make_unique<test::PlayedStream>(blank_pictures({1, 2, 3}), StreamEnd::kEnded));
    streams.push_back(std::make_unique<test::PlayedStream>(blank_pictures({1}), StreamEnd::kGone));
    LiveCameras cameras(std::move(streams));
    ASSERT_TRUE(cameras.next(0).has_value());
    const auto end = cameras.next(0);
    ASSERT_FALSE(end.has_value());
    EXPECT_EQ(end.error().kind, StreamEnd::kGone);
    EXPECT_EQ(end.error().camera, 1U);
    EXPECT_EQ(cameras.stream(1).fault(), "unplugged");
}

}  // namespace
}  // namespace rig::host
