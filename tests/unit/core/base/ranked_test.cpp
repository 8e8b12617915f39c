#include "core/base/ranked.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "tests/support/random.hpp"

namespace {

using namespace rig;

TEST(Ranked, IsTheEntryOfTheSortedValues) {
    test::SeededRandom random(5);
    for (std::size_t n = 1; n < 40; ++n) {
        std::vector<float> values(n);
        for (float& value : values) value = static_cast<float>(random.uniform(-3.0, 3.0));
        std::vector<float> sorted = values;
        std::sort(sorted.begin(), sorted.end());
        for (std::size_t rank = 0; rank < n; ++rank) {
            std::vector<float> shuffled = values;
            EXPECT_EQ(ranked(shuffled, rank), static_cast<double>(sorted[rank]));
        }
        EXPECT_EQ(median(std::span(values)), static_cast<double>(sorted[n / 2]));
    }
}

TEST(Ranked, TakesTheGreaterOfTwoInTheMiddle) {
    std::array<double, 4> values{4.0, 1.0, 3.0, 2.0};
    EXPECT_EQ(median(values), 3.0);
}

}  // namespace
