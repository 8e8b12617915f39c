#include "core/filter/frame_interval.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace rig {
namespace {

constexpr std::int64_t kEarliest = std::numeric_limits<std::int64_t>::min();
constexpr std::int64_t kLatest = std::numeric_limits<std::int64_t>::max();

TEST(FrameInterval, BelievesQuarterToFourFrames) {
    for (const std::int64_t us : {2500, 2501, 10000, 39999, 40000}) {
        const FrameInterval interval = frame_interval(1'000'000, 1'000'000 + us, 100.0);
        EXPECT_TRUE(interval.believable) << us;
        EXPECT_DOUBLE_EQ(interval.seconds, static_cast<double>(us) * 1e-6);
    }
}

TEST(FrameInterval, ClampsWhatIsOutside) {
    for (const std::int64_t us : {2499, 1, 0, -1, -10000}) {
        const FrameInterval interval = frame_interval(1'000'000, 1'000'000 + us, 100.0);
        EXPECT_FALSE(interval.believable) << us;
        EXPECT_DOUBLE_EQ(interval.seconds, 0.0025);
    }
    for (const std::int64_t us :
         {std::int64_t{40001}, std::int64_t{1'000'000}, std::int64_t{3'600'000'000}}) {
        const FrameInterval interval = frame_interval(1'000'000, 1'000'000 + us, 100.0);
        EXPECT_FALSE(interval.believable) << us;
        EXPECT_DOUBLE_EQ(interval.seconds, 0.04);
    }
}

TEST(FrameInterval, SurvivesWildTimes) {
    for (const std::int64_t a : {kEarliest, std::int64_t{-1}, std::int64_t{0}, kLatest}) {
        for (const std::int64_t b : {kEarliest, std::int64_t{0}, std::int64_t{1}, kLatest}) {
            const FrameInterval interval = frame_interval(a, b, 60.0);
            EXPECT_TRUE(interval.seconds == 0.25 / 60.0 || interval.seconds == 4.0 / 60.0) << a << " " << b;
            EXPECT_EQ(interval.seconds == 4.0 / 60.0, static_cast<double>(b) - static_cast<double>(a) > 1e6)
                << a << " " << b;
        }
    }
}

}  // namespace
}  // namespace rig
