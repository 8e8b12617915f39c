#include "core/wire/crc32c.hpp"

#include <array>

namespace rig {

namespace {

constexpr std::uint32_t kPolynomial = 0x82F63B78U;
constexpr std::size_t kSlices = 8;

using SliceTable = std::array<std::array<std::uint32_t, 256>, kSlices>;

// Row k holds the effect of a byte that is followed by k zero bytes.
constexpr SliceTable make_table() {
    SliceTable table{};
    for (std::uint32_t byte = 0; byte < 256; ++byte) {
        std::uint32_t crc = byte;
        for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1U) != 0 ? kPolynomial : 0U);
        table[0][byte] = crc;
    }
    for (std::size_t slice = 1; slice < kSlices; ++slice) {
        for (std::size_t byte = 0; byte < 256; ++byte) {
            const std::uint32_t before = table[slice - 1][byte];
            table[slice][byte] = (before >> 8) ^ table[0][before & 0xFFU];
        }
    }
    return table;
}

constexpr SliceTable kTable = make_table();

}  // namespace

std::uint32_t crc32c(ByteSpan bytes) {
    std::uint32_t crc = 0xFFFFFFFFU;
    std::size_t at = 0;
    for (; bytes.size() - at >= kSlices; at += kSlices) {
        const std::uint32_t low = load<std::uint32_t>(bytes, at) ^ crc;
        const auto high = load<std::uint32_t>(bytes, at + 4);
        crc = kTable[7][low & 0xFFU] ^ kTable[6][(low >> 8) & 0xFFU] ^ kTable[5][(low >> 16) & 0xFFU] ^
              kTable[4][low >> 24] ^ kTable[3][high & 0xFFU] ^ kTable[2][(high >> 8) & 0xFFU] ^
              kTable[1][(high >> 16) & 0xFFU] ^ kTable[0][high >> 24];
    }
    for (; at < bytes.size(); ++at) {
        crc = (crc >> 8) ^ kTable[0][(crc ^ std::to_integer<std::uint32_t>(bytes[at])) & 0xFFU];
    }
    return ~crc;
}

}  // namespace rig
