#include "firmware_host/daemon/wear.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/support/random.hpp"

namespace rig::test {
namespace {

TEST(FaultBook, CountsRisesNotPresence) {
    FaultBook book;
    const FaultMap gone = fault_bit(Fault::kCameraGone);
    const FaultMap slot = fault_bit(Fault::kNoSlot);
    EXPECT_EQ(book.look(gone).raised, gone);
    EXPECT_EQ(book.look(gone | slot).raised, slot);
    const auto change = book.look(slot);
    EXPECT_EQ(change.raised, 0U);
    EXPECT_EQ(change.cleared, gone);
    static_cast<void>(book.look(gone));
    EXPECT_EQ(book.counts()[0], 2);
    EXPECT_EQ(book.counts()[54], 1);
    EXPECT_EQ(book.present(), gone);
}

TEST(FaultBook, Saturates) {
    FaultBook book;
    for (int i = 0; i < 70'000; ++i) {
        static_cast<void>(book.look(1));
        static_cast<void>(book.look(0));
    }
    EXPECT_EQ(book.counts()[0], 0xFFFF);
}

TEST(TimeBook, EmptyAndExtremes) {
    TimeBook book;
    EXPECT_EQ(book.spread(), TimeSpread{});
    book.add(-5);
    EXPECT_EQ(book.spread(), TimeSpread{});
    book.add(std::int64_t{1} << 40);
    EXPECT_EQ(book.spread().max_us, 0xFFFF'FFFFU);
}

// Never below the sorted truth, never more than 1/16 above it.
TEST(TimeBook, SharesAreWithinAClass) {
    SeededRandom random(4);
    for (int round = 0; round < 20; ++round) {
        TimeBook book;
        std::vector<std::uint32_t> times;
        for (int i = 0; i < 2000; ++i) {
            times.push_back(static_cast<std::uint32_t>(random.bits() >> (32 + random.below(32))));
            book.add(times.back());
        }
        std::sort(times.begin(), times.end());
        const TimeSpread spread = book.spread();
        const auto check = [&](std::uint32_t told, double share) {
            const auto truth = static_cast<double>(times[static_cast<std::size_t>(share * 1999.0)]);
            EXPECT_GE(told, truth);
            EXPECT_LE(told, truth * (1.0 + 1.0 / 16.0) + 1.0);
        };
        check(spread.p50_us, 0.5);
        check(spread.p99_us, 0.99);
        EXPECT_EQ(spread.max_us, times.back());
    }
}

}  // namespace
}  // namespace rig::test
