#include "core/wire/text.hpp"

namespace rig {

namespace {

constexpr bool is_continuation(char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U;
}

struct Lead {
    std::size_t length;      // 0: not a lead byte
    std::uint32_t bits;      // of the lead byte
    std::uint32_t smallest;  // code point that needs this length
};

constexpr Lead lead_of(unsigned char c) {
    if (c < 0x80U) return {1, c, 0};
    if ((c & 0xE0U) == 0xC0U) return {2, c & 0x1FU, 0x80};
    if ((c & 0xF0U) == 0xE0U) return {3, c & 0x0FU, 0x800};
    if ((c & 0xF8U) == 0xF0U) return {4, c & 0x07U, 0x10000};
    return {0, 0, 0};
}

}  // namespace

bool is_printable_utf8(std::string_view text) {
    std::size_t at = 0;
    while (at < text.size()) {
        const Lead lead = lead_of(static_cast<unsigned char>(text[at]));
        if (lead.length == 0 || lead.length > text.size() - at) return false;
        std::uint32_t code = lead.bits;
        for (std::size_t i = 1; i < lead.length; ++i) {
            if (!is_continuation(text[at + i])) return false;
            code = (code << 6) | (static_cast<unsigned char>(text[at + i]) & 0x3FU);
        }
        if (code < lead.smallest || code > 0x10FFFFU || (code >= 0xD800U && code <= 0xDFFFU)) return false;
        if (code < 0x20U || (code >= 0x7FU && code <= 0x9FU)) return false;
        at += lead.length;
    }
    return true;
}

std::string_view utf8_prefix(std::string_view text, std::size_t bytes) {
    if (text.size() <= bytes) return text;
    while (bytes > 0 && is_continuation(text[bytes])) --bytes;
    return text.substr(0, bytes);
}

}  // namespace rig
