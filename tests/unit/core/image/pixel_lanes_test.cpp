// Eight lanes against one pixel after the other.
#include "core/image/pixel_lanes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/support/random.hpp"

namespace {

using namespace rig;

PixelLanes random_lanes(test::SeededRandom& random, double reach) {
    PixelLanes lanes;
    for (int i = 0; i < kPixelLanes; ++i) lanes[i] = static_cast<std::int16_t>(random.uniform(-reach, reach));
    return lanes;
}

TEST(PixelLanes, PixelsAreLoadedInOrderAndTurned) {
    const std::array<std::uint8_t, 8> bytes{0, 1, 2, 127, 128, 200, 254, 255};
    for (const std::uint8_t turn : {std::uint8_t{0}, std::uint8_t{255}}) {
        const PixelLanes lanes = load_pixels(bytes.data(), turn);
        for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(lanes[static_cast<int>(i)], bytes[i] ^ turn);
    }
}

TEST(PixelLanes, BitsBecomeMasksAndComeBack) {
    for (std::uint64_t bits = 0; bits < 256; ++bits) {
        const PixelLanes mask = lanes_of_bits(bits | 0xABCD00U);  // only the lowest eight count
        for (int i = 0; i < kPixelLanes; ++i) EXPECT_EQ(mask[i], (bits >> i & 1U) != 0 ? -1 : 0);
        EXPECT_EQ(bits_of_lanes(mask), bits);
    }
}

TEST(PixelLanes, SixteenBitsBecomeBytesAndComeBack) {
    for (std::uint32_t bits = 0; bits < 65536; bits += 37) {
        const SixteenBytes mask = bytes_of_bits(bits | 0xABC0000U);  // only the lowest sixteen count
        std::uint32_t count = 0;
        for (int i = 0; i < kByteLanes; ++i) {
            EXPECT_EQ(mask[i], (bits >> i & 1U) != 0 ? 255 : 0);
            count += bits >> i & 1U;
        }
        EXPECT_EQ(bits_of_bytes(mask), bits);
        EXPECT_EQ(sum_of_bytes(mask), 255U * count);
        const SixteenBytes packed = bytes_of_masks(lanes_of_bits(bits), lanes_of_bits(bits >> 8));
        EXPECT_EQ(bits_of_bytes(packed), bits);
    }
}

TEST(PixelLanes, BytesComeFromLanesAndFromEveryBlock) {
    test::SeededRandom random(6);
    for (int round = 0; round < 100; ++round) {
        std::array<std::uint8_t, 16> bytes;
        for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.below(256));
        const SixteenBytes back = bytes_of_lanes(load_pixels(bytes.data(), 0), load_pixels(&bytes[8], 0));
        const SixteenBytes spread = load_four_times_each(bytes.data());
        for (int i = 0; i < kByteLanes; ++i) {
            EXPECT_EQ(back[i], bytes[static_cast<std::size_t>(i)]);
            EXPECT_EQ(spread[i], bytes[static_cast<std::size_t>(i / 4)]);
        }
    }
}

TEST(PixelLanes, RanksAreThoseOfSortedBytes) {
    test::SeededRandom random(7);
    for (int round = 0; round < 100; ++round) {
        std::array<std::uint8_t, 16> bytes;
        const std::uint32_t values = round % 2 == 0 ? 256 : 4;  // with repeats
        for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(255 - random.below(values));
        const SixteenBytes lanes = load_bytes(bytes.data());
        std::sort(bytes.begin(), bytes.end());
        for (std::uint32_t rank = 0; rank < 16; ++rank) EXPECT_EQ(ranked_byte(lanes, rank), bytes[rank]);
    }
}

TEST(PixelLanes, TheGreaterAndTheLessAreTheSecondWhenEqual) {
    const FourFloats a{1.0F, -2.0F, 3.0F, 0.0F};
    const FourFloats b{2.0F, -3.0F, 3.0F, -0.0F};
    const FourFloats greater = greater_of(a, b);
    const FourFloats less = less_of(a, b);
    for (int i = 0; i < 4; ++i) {
        EXPECT_EQ(greater[i], a[i] > b[i] ? a[i] : b[i]);
        EXPECT_EQ(less[i], a[i] < b[i] ? a[i] : b[i]);
    }
    EXPECT_TRUE(std::signbit(greater[3]));
    EXPECT_TRUE(std::signbit(less[3]));
}

TEST(PixelLanes, NumbersAreKeptOnTheWayToIntsAndFloats) {
    test::SeededRandom random(3);
    for (int round = 0; round < 100; ++round) {
        const PixelLanes lanes = random_lanes(random, 32767.0);
        const EightInts ints = ints_of_lanes(lanes);
        const EightFloats floats = floats_of_lanes(lanes);
        for (int i = 0; i < 4; ++i) {
            EXPECT_EQ(ints.low[i], lanes[i]);
            EXPECT_EQ(ints.high[i], lanes[i + 4]);
            EXPECT_EQ(floats.low[i], static_cast<float>(lanes[i]));
            EXPECT_EQ(floats.high[i], static_cast<float>(lanes[i + 4]));
        }
        const PixelLanes back = rounded_lanes({floats.low + 0.25F, floats.high - 0.25F});
        for (int i = 0; i < kPixelLanes; ++i) EXPECT_EQ(back[i], lanes[i]);
    }
}

TEST(PixelLanes, SumsAreThoseOfWideIntegers) {
    test::SeededRandom random(4);
    for (int round = 0; round < 100; ++round) {
        const PixelLanes a = random_lanes(random, 32767.0);
        const PixelLanes b = random_lanes(random, 4000.0);
        int sum = 0;
        int products = 0;
        for (int i = 0; i < kPixelLanes; ++i) sum += a[i], products += int{a[i]} * b[i];
        EXPECT_EQ(sum_of_lanes(a), sum);
        EXPECT_EQ(sum_of_products(a, b), products);
    }
}

TEST(PixelLanes, CountingStartsWhereAsked) {
    const PixelLanes lanes = counting_lanes(-3);
    for (int i = 0; i < kPixelLanes; ++i) EXPECT_EQ(lanes[i], i - 3);
}

}  // namespace
