#include "core/wire/crc32c.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string_view>
#include <vector>

namespace {

rig::ByteSpan bytes_of(std::string_view text) {
    return std::as_bytes(std::span(text.data(), text.size()));
}

std::uint32_t bit_by_bit(rig::ByteSpan bytes) {
    std::uint32_t crc = 0xFFFFFFFFU;
    for (const std::byte byte : bytes) {
        crc ^= std::to_integer<std::uint32_t>(byte);
        for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1U) != 0 ? 0x82F63B78U : 0U);
    }
    return ~crc;
}

TEST(Crc32c, HasTheCheckValue) {
    EXPECT_EQ(rig::crc32c(bytes_of("123456789")), 0xE3069283U);
}

TEST(Crc32c, HasTheVectorsOfRfc3720) {
    EXPECT_EQ(rig::crc32c(std::vector<std::byte>(32, std::byte{0})), 0x8A9136AAU);
    EXPECT_EQ(rig::crc32c(std::vector<std::byte>(32, std::byte{0xFF})), 0x62A8AB43U);
}

TEST(Crc32c, AgreesWithTheDefinitionAtEveryLengthAndAlignment) {
    std::mt19937 random(1);
    std::vector<std::byte> bytes(700);
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
    for (std::size_t start = 0; start < 9; ++start) {
        for (std::size_t size = 0; size + start <= bytes.size(); size += size < 40 ? 1 : 37) {
            const auto part = rig::ByteSpan(bytes).subspan(start, size);
            ASSERT_EQ(rig::crc32c(part), bit_by_bit(part)) << start << ' ' << size;
        }
    }
}

}  // namespace
