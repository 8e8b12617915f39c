#include "core/base/bytes.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <limits>

namespace rig {
namespace {

constexpr std::size_t kHuge = std::numeric_limits<std::size_t>::max();

template <std::size_t kSize>
std::array<std::byte, kSize> bytes_of(const std::array<int, kSize>& values) {
    std::array<std::byte, kSize> bytes{};
    for (std::size_t i = 0; i < kSize; ++i) bytes[i] = static_cast<std::byte>(values[i]);
    return bytes;
}

TEST(Bytes, AreLittleEndianAndNeedNoAlignment) {
    const auto bytes = bytes_of<9>({0xff, 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x88});
    EXPECT_EQ(load<std::uint16_t>(bytes, 1), 0x0201);
    EXPECT_EQ(load<std::uint32_t>(bytes, 1), 0x04030201U);
    EXPECT_EQ(load<std::uint64_t>(bytes, 1), 0x8807060504030201ULL);
    EXPECT_EQ(load<std::int8_t>(bytes, 0), -1);
}

TEST(Bytes, StoreWritesItsRangeOnly) {
    std::array<std::byte, 6> bytes{};
    store<std::uint32_t>(bytes, 1, 0xa1b2c3d4U);
    EXPECT_EQ(bytes, bytes_of<6>({0x00, 0xd4, 0xc3, 0xb2, 0xa1, 0x00}));
    store(bytes, 1, 1.5F);
    EXPECT_EQ(load<float>(bytes, 1), 1.5F);
}

TEST(BytesDeathTest, LoadAndStorePastTheEndAreBugs) {
    std::array<std::byte, 4> bytes{};
    EXPECT_DEATH(static_cast<void>(load<std::uint32_t>(bytes, 1)), "");
    EXPECT_DEATH(static_cast<void>(load<std::uint8_t>(bytes, kHuge)), "");
    EXPECT_DEATH(store<std::uint16_t>(bytes, 3, 1), "");
}

TEST(ByteReader, ReadsToTheExactEnd) {
    const auto bytes = bytes_of<5>({1, 2, 0, 9, 8});
    ByteReader reader(bytes);
    EXPECT_EQ(reader.read<std::uint8_t>(), 1);
    EXPECT_EQ(reader.read<std::uint16_t>(), 2);
    EXPECT_EQ(reader.remaining(), 2U);
    const ByteSpan rest = reader.read_bytes(2);
    EXPECT_EQ(rest[1], std::byte{8});
    EXPECT_TRUE(reader.ok());
    EXPECT_EQ(reader.remaining(), 0U);
    EXPECT_TRUE(reader.read_bytes(0).empty());
    EXPECT_TRUE(reader.ok());
}

TEST(ByteReader, YieldsZeroPastTheEndForGood) {
    const auto bytes = bytes_of<3>({7, 7, 7});
    ByteReader reader(bytes);
    EXPECT_EQ(reader.read<std::uint32_t>(), 0U);
    EXPECT_FALSE(reader.ok());
    EXPECT_EQ(reader.read<std::uint8_t>(), 0) << "a shorter read after the fault must not succeed";
    EXPECT_TRUE(reader.read_bytes(1).empty());
    EXPECT_FALSE(reader.ok());
}

TEST(ByteReader, RefusesLengthsThatWouldWrap) {
    const auto bytes = bytes_of<3>({1, 2, 3});
    ByteReader reader(bytes);
    EXPECT_EQ(reader.read<std::uint8_t>(), 1);
    EXPECT_TRUE(reader.read_bytes(kHuge).empty());
    EXPECT_FALSE(reader.ok());
}

TEST(ByteReader, OfNothingHasNothing) {
    ByteReader reader{ByteSpan{}};
    EXPECT_TRUE(reader.ok());
    EXPECT_TRUE(reader.read_bytes(0).empty());
    EXPECT_TRUE(reader.ok());
    EXPECT_EQ(reader.read<std::uint8_t>(), 0);
    EXPECT_FALSE(reader.ok());
}

TEST(ByteWriter, WritesToTheExactEnd) {
    std::array<std::byte, 5> bytes{};
    ByteWriter writer(bytes);
    writer.write<std::uint16_t>(0x0102);
    writer.write_bytes(bytes_of<3>({3, 4, 5}));
    EXPECT_TRUE(writer.ok());
    EXPECT_EQ(writer.size(), 5U);
    EXPECT_EQ(bytes, bytes_of<5>({2, 1, 3, 4, 5}));
    writer.write_bytes({});
    EXPECT_TRUE(writer.ok());
}

TEST(ByteWriter, WritesNothingPastTheEndForGood) {
    std::array<std::byte, 3> bytes{};
    ByteWriter writer(bytes);
    writer.write<std::uint32_t>(0xffffffffU);
    EXPECT_FALSE(writer.ok());
    writer.write<std::uint8_t>(0xff);
    writer.write_bytes(bytes_of<1>({0xff}));
    EXPECT_EQ(writer.size(), 0U);
    EXPECT_TRUE(writer.written().empty());
    EXPECT_EQ(bytes, bytes_of<3>({0, 0, 0}));
}

TEST(ByteWriter, ReadsBackWhatItWrote) {
    std::array<std::byte, 32> bytes{};
    ByteWriter writer(bytes);
    writer.write(-2.25);
    writer.write<std::int64_t>(-5);
    writer.write<std::uint8_t>(200);
    ASSERT_TRUE(writer.ok());
    ByteReader reader(writer.written());
    EXPECT_EQ(reader.read<double>(), -2.25);
    EXPECT_EQ(reader.read<std::int64_t>(), -5);
    EXPECT_EQ(reader.read<std::uint8_t>(), 200);
    EXPECT_TRUE(reader.ok());
    EXPECT_EQ(reader.remaining(), 0U);
}

}  // namespace
}  // namespace rig
