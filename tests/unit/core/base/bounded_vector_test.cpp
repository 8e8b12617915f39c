#include "core/base/bounded_vector.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <numeric>
#include <vector>

#include "tests/support/random.hpp"

namespace rig {
namespace {

template <std::size_t kCapacity>
void fills_to_capacity_and_refuses_one_more() {
    BoundedVector<int, kCapacity> items;
    EXPECT_TRUE(items.empty());
    for (std::size_t i = 0; i < kCapacity; ++i) {
        EXPECT_FALSE(items.full());
        EXPECT_TRUE(items.push_back(static_cast<int>(i)));
    }
    EXPECT_TRUE(items.full());
    EXPECT_FALSE(items.push_back(-1));
    ASSERT_EQ(items.size(), kCapacity);
    for (std::size_t i = 0; i < kCapacity; ++i) EXPECT_EQ(items[i], static_cast<int>(i));
}

TEST(BoundedVector, FillsToCapacityAndRefusesOneMore) {
    fills_to_capacity_and_refuses_one_more<1>();
    fills_to_capacity_and_refuses_one_more<2>();
    fills_to_capacity_and_refuses_one_more<257>();
}

TEST(BoundedVector, ClearsAndFillsAgain) {
    BoundedVector<int, 2> items;
    ASSERT_TRUE(items.push_back(1));
    ASSERT_TRUE(items.push_back(2));
    items.clear();
    EXPECT_TRUE(items.empty());
    EXPECT_EQ(items.begin(), items.end());
    EXPECT_TRUE(items.push_back(3));
    EXPECT_EQ(items[0], 3);
}

TEST(BoundedVector, SpansAndIteratesOverValidElementsOnly) {
    BoundedVector<int, 8> items;
    for (int i = 1; i <= 5; ++i) ASSERT_TRUE(items.push_back(i));
    EXPECT_EQ(std::accumulate(items.begin(), items.end(), 0), 15);
    EXPECT_EQ(items.span().size(), 5U);
    items.span()[2] = 30;
    const BoundedVector<int, 8>& fixed = items;
    EXPECT_EQ(fixed[2], 30);
    EXPECT_EQ(fixed.span().back(), 5);
}

TEST(BoundedVector, WorksInConstantExpressions) {
    constexpr int kSum = [] {
        BoundedVector<int, 3> items;
        if (!items.push_back(4) || !items.push_back(5)) return -1;
        items.pop_back();
        items.resize(2);
        return items[0] + static_cast<int>(items.size());
    }();
    EXPECT_EQ(kSum, 6);
}

// Random operations against a std::vector that keeps the same rules.
TEST(BoundedVector, AgreesWithAModel) {
    test::SeededRandom random(20261121);
    BoundedVector<int, 7> items;
    std::vector<int> model;
    for (int step = 0; step < 5000; ++step) {
        const int value = static_cast<int>(random.below(1000));
        switch (random.below(4)) {
            case 0:
            case 1:
                EXPECT_EQ(items.push_back(value), model.size() < 7);
                if (model.size() < 7) model.push_back(value);
                break;
            case 2:
                if (model.empty()) break;
                items.pop_back();
                model.pop_back();
                break;
            default:
                if (!random.chance(0.1)) break;
                items.clear();
                model.clear();
        }
        ASSERT_EQ(std::vector<int>(items.begin(), items.end()), model) << "step " << step;
    }
}

TEST(BoundedVectorDeathTest, TrapsOnOurOwnBugs) {
    BoundedVector<int, 2> items;
    EXPECT_DEATH(static_cast<void>(items[0]), "");
    EXPECT_DEATH(items.pop_back(), "");
    EXPECT_DEATH(items.resize(3), "");
}

}  // namespace
}  // namespace rig
