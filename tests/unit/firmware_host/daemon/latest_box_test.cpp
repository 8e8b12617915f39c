#include "firmware_host/daemon/latest_box.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace rig::test {
namespace {

TEST(LatestBox, GivesTheNewestOnce) {
    LatestBox<int> box;
    EXPECT_EQ(box.take(), nullptr);
    box.back() = 1;
    EXPECT_FALSE(box.publish());
    box.back() = 2;
    EXPECT_TRUE(box.publish());  // 1 was never read
    EXPECT_TRUE(box.fresh());
    ASSERT_NE(box.take(), nullptr);
    EXPECT_EQ(box.take(), nullptr);
    box.back() = 3;
    EXPECT_FALSE(box.publish());
    EXPECT_EQ(*box.take(), 3);
}

// Values arrive whole, in order, and what was not read was reported as replaced.
TEST(LatestBox, TwoThreads) {
    struct Pair {
        std::uint64_t a = 0;
        std::uint64_t b = 0;
    };
    LatestBox<Pair> box;
    constexpr std::uint64_t kValues = 200'000;
    std::uint64_t replaced = 0;
    std::thread writer([&] {
        for (std::uint64_t i = 1; i <= kValues; ++i) {
            box.back() = {i, ~i};
            replaced += box.publish() ? 1 : 0;
        }
    });
    std::uint64_t last = 0;
    std::uint64_t read = 0;
    while (last < kValues) {
        const Pair* pair = box.take();
        if (pair == nullptr) continue;
        ASSERT_EQ(pair->b, ~pair->a);
        ASSERT_GT(pair->a, last);
        last = pair->a;
        ++read;
    }
    writer.join();
    EXPECT_EQ(read + replaced, kValues);
}

}  // namespace
}  // namespace rig::test
