#include "core/wire/text.hpp"

#include <gtest/gtest.h>

namespace {

using rig::is_printable_utf8;

TEST(Text, AcceptsPrintableUtf8) {
    for (const char* text : {"", "jawOpen",
                             "b\xC3\xA4"
                             "cke",
                             "\xE2\x82\xAC", "\xF0\x9F\x99\x82", "\xF4\x8F\xBF\xBF", "\xC2\xA0", " ", "~"}) {
        EXPECT_TRUE(is_printable_utf8(text)) << text;
    }
}

TEST(Text, RefusesControlCharactersThatATerminalWouldObey) {
    for (const char* text : {"\x1B[2J", "a\nb", "\x7F", "\xC2\x9B", "\xC2\x80", "\r"}) {
        EXPECT_FALSE(is_printable_utf8(text));
    }
    EXPECT_FALSE(is_printable_utf8(std::string_view("a\0b", 3)));
}

TEST(Text, RefusesMalformedUtf8) {
    for (const char* text : {"\xC3", "\x80", "\xC0\xAF", "\xE0\x80\xAF", "\xED\xA0\x80", "\xF4\x90\x80\x80",
                             "\xFF", "\xF8\x88\x80\x80\x80", "\xE2\x82", "a\xE2\x28\xA1"}) {
        EXPECT_FALSE(is_printable_utf8(text));
    }
}

TEST(Text, CutsAtACharactersBoundary) {
    EXPECT_EQ(rig::utf8_prefix("abc", 5), "abc");
    EXPECT_EQ(rig::utf8_prefix("abc", 2), "ab");
    EXPECT_EQ(rig::utf8_prefix("a\xC3\xA4", 2), "a");
    EXPECT_EQ(rig::utf8_prefix("\xF0\x9F\x99\x82", 3), "");
    EXPECT_EQ(rig::FixedText<4>("ab\xE2\x82\xAC").view(), "ab");
    EXPECT_EQ(rig::FixedText<5>("ab\xE2\x82\xAC").view(), "ab\xE2\x82\xAC");
}

}  // namespace
