#include "firmware_host/companion/links/time_sync.hpp"

#include <gtest/gtest.h>

#include "tests/support/random.hpp"

namespace {

using rig::TimeReply;
using rig::host::TimeSync;

// One exchange with a board whose clock is `ahead_us` ahead.
struct Exchange {
    std::int64_t start_us;
    std::int64_t there_us;
    std::int64_t inside_us;
    std::int64_t back_us;
};

bool add(TimeSync& sync, const Exchange& e, std::int64_t ahead_us) {
    const std::int64_t arrived_us = e.start_us + e.there_us;
    const TimeReply reply{e.start_us, arrived_us + ahead_us, arrived_us + e.inside_us + ahead_us};
    return sync.add(reply, arrived_us + e.inside_us + e.back_us);
}

TEST(TimeSync, EqualDelaysGiveTheExactOffset) {
    TimeSync sync;
    EXPECT_FALSE(sync.known());
    EXPECT_FALSE(sync.host_time_us(5).has_value());
    EXPECT_TRUE(add(sync, {1000, 300, 50, 300}, 7'000'000));
    EXPECT_EQ(sync.offset_us(), 7'000'000);
    EXPECT_EQ(sync.round_trip_us(), 600);
    EXPECT_EQ(sync.host_time_us(7'000'500), 500);
}

TEST(TimeSync, BelievesTheShortestRoundTripAndIsWrongByAtMostHalfOfIt) {
    rig::test::SeededRandom random(3);
    TimeSync sync;
    for (int i = 0; i < 200; ++i) {
        const auto delay = [&] {
            return static_cast<std::int64_t>(100 + random.below(random.chance(0.2) ? 50000 : 300));
        };
        ASSERT_TRUE(add(sync, {i * 1'000'000LL, delay(), 20, delay()}, -123'456'789));
        ASSERT_LE(std::abs(sync.offset_us() + 123'456'789), sync.round_trip_us() / 2 + 1);
    }
    EXPECT_LT(sync.round_trip_us(), 800);
}

TEST(TimeSync, OldSamplesGo) {
    TimeSync sync;
    ASSERT_TRUE(add(sync, {0, 1, 0, 1}, 1000));
    for (std::size_t i = 0; i < TimeSync::kSamples; ++i) ASSERT_TRUE(add(sync, {1000, 50, 0, 50}, 2000));
    EXPECT_EQ(sync.offset_us(), 2000);
    EXPECT_EQ(sync.sample_count(), TimeSync::kSamples);
    sync.reset();
    EXPECT_FALSE(sync.known());
}

TEST(TimeSync, RefusesTimesThatContradictEachOther) {
    TimeSync sync;
    EXPECT_FALSE(sync.add({2000, 0, 0}, 1000)) << "received before it was sent";
    EXPECT_FALSE(sync.add({0, 0, 500}, 400)) << "longer inside the board than away";
    EXPECT_FALSE(sync.add({0, 0, 0}, TimeSync::kLongestRoundTrip_us + 1));
    EXPECT_FALSE(sync.add({-rig::kMaxWireTime_us, 0, 0}, 1000)) << "a time that was never sent";
    EXPECT_FALSE(sync.known());
    EXPECT_TRUE(sync.add({0, rig::kMaxWireTime_us, rig::kMaxWireTime_us}, 1000)) << "any clock of the board";
}

}  // namespace
