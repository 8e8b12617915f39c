#include "firmware_host/companion/fit/marker_take.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/temp_folder.hpp"

namespace rig::host {
namespace {

TEST(MarkerTake, ReadsWhatWasRecorded) {
    const test::TempFolder folder;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const NpyArray<float> array{.shape = {2, 2, 3}, .values = {1, 2, 3, nan, nan, nan, 4, 5, 6, 7, 8, 1e30F}};
    ASSERT_TRUE(write_npy(folder / "take.npy", array));
    const auto take = load_marker_take(folder / "take.npy", 120.0);
    ASSERT_TRUE(take) << take.error().message;
    EXPECT_EQ(take->frame_count, 2U);
    EXPECT_EQ(take->marker_count, 2U);
    EXPECT_EQ(take->rate_hz, 120.0);
    EXPECT_EQ(take->at(1, 0), Vec3(4, 5, 6));
    EXPECT_TRUE(take->seen(0, 0));
    EXPECT_FALSE(take->seen(0, 1));
    EXPECT_FALSE(take->seen(1, 1));  // a number, but no place
}

TEST(MarkerTake, NamesTheFileAtFault) {
    const test::TempFolder folder;
    EXPECT_NE(load_marker_take(folder / "none.npy", 60.0).error().message.find("none.npy"),
              std::string::npos);
    for (const std::vector<std::size_t>& shape :
         {std::vector<std::size_t>{4, 3}, {2, 2, 2}, {0, 5, 3}, {5, 0, 3}}) {
        std::size_t count = 1;
        for (const std::size_t side : shape) count *= side;
        const auto take =
            marker_take_of({.shape = shape, .values = std::vector<float>(count)}, "bad.npy", 60.0);
        ASSERT_FALSE(take);
        EXPECT_NE(take.error().message.find("bad.npy"), std::string::npos);
    }
}

TEST(MarkerTake, ThinsEvenly) {
    MarkerTake take{.frame_count = 10, .marker_count = 1, .rate_hz = 60.0, .positions_mm = {}};
    for (int f = 0; f < 10; ++f) take.positions_mm.emplace_back(f, 0, 0);
    EXPECT_EQ(thinned(take, 10).frame_count, 10U);
    const MarkerTake thin = thinned(take, 4);
    ASSERT_EQ(thin.frame_count, 4U);  // 0, 3, 6, 9
    EXPECT_EQ(thin.at(3, 0)[0], 9.0);
    EXPECT_EQ(thin.rate_hz, 20.0);
}

}  // namespace
}  // namespace rig::host
