#include "firmware_host/pack_file/sha256.hpp"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace rig {
namespace {

std::string hex_of(std::string_view text) {
    Hash digest{};
    sha256(std::as_bytes(std::span(text)), digest);
    std::string out;
    for (const std::byte b : digest) {
        out += "0123456789abcdef"[std::to_integer<unsigned>(b) >> 4];
        out += "0123456789abcdef"[std::to_integer<unsigned>(b) & 15U];
    }
    return out;
}

// FIPS 180-4's examples.
TEST(Sha256, KnownAnswers) {
    EXPECT_EQ(hex_of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    EXPECT_EQ(hex_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    EXPECT_EQ(hex_of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
              "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
}

}  // namespace
}  // namespace rig
