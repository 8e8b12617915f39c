#include "core/wire/health.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace {

using namespace rig;

TEST(Health, RefusesEveryOtherLength) {
    std::vector<std::byte> bytes(kStatusBytes + 1);
    for (std::size_t size = 0; size <= bytes.size(); ++size) {
        const auto decoded = decode_status(ByteSpan(bytes).first(size));
        EXPECT_EQ(decoded.has_value(), size == kStatusBytes) << size;
        EXPECT_EQ(encode(Health{}, MutableByteSpan(bytes).first(size)).has_value(), size >= kStatusBytes);
    }
}

TEST(Health, RefusesAStateThatDoesNotExistAndNegativeUptime) {
    Health health;
    std::vector<std::byte> bytes(kStatusBytes);
    health.uptime_us = -1;
    EXPECT_EQ(encode(health, bytes).error(), WireError::kRange);
    health.uptime_us = 0;
    ASSERT_TRUE(encode(health, bytes).has_value());
    bytes[132] = std::byte{5};
    EXPECT_EQ(decode_status(bytes).error(), WireError::kRange);
}

TEST(Health, EveryFieldSurvives) {
    // A payload of distinct bytes decodes and encodes to itself, so no field is dropped or doubled.
    std::vector<std::byte> bytes(kStatusBytes);
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::byte>(i * 37 + 11);
    bytes[7] = bytes[15] = std::byte{0};
    bytes[132] = std::byte{3};
    const auto health = decode_status(bytes);
    ASSERT_TRUE(health.has_value());
    std::vector<std::byte> again(kStatusBytes);
    ASSERT_EQ(encode(*health, again).value(), kStatusBytes);
    EXPECT_EQ(again, bytes);
}

}  // namespace
