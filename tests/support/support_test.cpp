#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <span>
#include <string>
#include <string_view>

#include "tests/support/digest.hpp"
#include "tests/support/random.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::test {
namespace {

std::uint64_t digest_of(std::string_view text) {
    return Digest().add_bytes(std::as_bytes(std::span<const char>(text))).value();
}

TEST(Digest, HasThePublishedValues) {
    EXPECT_EQ(digest_of(""), 0xcbf29ce484222325ULL);
    EXPECT_EQ(digest_of("a"), 0xaf63dc4c8601ec8cULL);
    EXPECT_EQ(digest_of("foobar"), 0x85944171f73967e8ULL);
}

TEST(Digest, TellsSignsOfZeroApart) {
    EXPECT_NE(Digest().add(0.0).value(), Digest().add(-0.0).value());
}

TEST(SeededRandom, IsTheSameEverywhere) {
    SeededRandom random(1234567);
    // The published sequence of SplitMix64 for this seed.
    EXPECT_EQ(random.bits(), 6457827717110365317ULL);
    EXPECT_EQ(random.bits(), 3203168211198807973ULL);
}

TEST(SeededRandom, HasTheMomentsItPromises) {
    SeededRandom random(1);
    constexpr int kCount = 200000;
    double sum = 0.0;
    double squares = 0.0;
    for (int i = 0; i < kCount; ++i) {
        const double u = random.uniform(2.0, 3.0);
        ASSERT_TRUE(u >= 2.0 && u < 3.0);
        ASSERT_LT(random.below(7), 7U);
        const double n = random.normal(5.0, 2.0);
        sum += n;
        squares += (n - 5.0) * (n - 5.0);
    }
    EXPECT_NEAR(sum / kCount, 5.0, 0.02);
    EXPECT_NEAR(std::sqrt(squares / kCount), 2.0, 0.02);
}

TEST(SeededRandom, ShufflesWithoutLoss) {
    SeededRandom random(1);
    std::array<int, 20> items{};
    std::iota(items.begin(), items.end(), 0);
    const std::array<int, 20> sorted = items;
    random.shuffle(std::span<int>(items));
    EXPECT_NE(items, sorted);
    std::sort(items.begin(), items.end());
    EXPECT_EQ(items, sorted);
}

TEST(TempFolder, ExistsOnlyWhileItLives) {
    std::filesystem::path path;
    {
        const TempFolder folder;
        path = folder.path();
        std::ofstream(folder / "a.txt") << "text";
        EXPECT_TRUE(std::filesystem::exists(folder / "a.txt"));
        EXPECT_NE(TempFolder().path(), path);
    }
    EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(SharedData, FollowsTheEnvironment) {
    const TempFolder folder;
    std::ofstream(folder / "take.csv") << "frame\n";
    const char* const before = std::getenv("RIG_SHARED_DATA");
    const std::string kept = before == nullptr ? "" : before;
    setenv("RIG_SHARED_DATA", folder.path().c_str(), 1);
    EXPECT_EQ(shared_data("take.csv"), folder / "take.csv");
    EXPECT_TRUE(shared_data("absent.csv").empty());
    if (before == nullptr) {
        unsetenv("RIG_SHARED_DATA");
    } else {
        setenv("RIG_SHARED_DATA", kept.c_str(), 1);
    }
}

}  // namespace
}  // namespace rig::test
