// Texts on the wire: printable UTF-8, because they end in terminals and file names of whoever listens.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace rig {

// Well-formed UTF-8 (no overlong forms, no surrogates, at most U+10FFFF) without control characters (C0, DEL,
// C1).
[[nodiscard]] bool is_printable_utf8(std::string_view text);

// The longest prefix of at most `bytes` bytes that does not cut a character in two.
[[nodiscard]] std::string_view utf8_prefix(std::string_view text, std::size_t bytes);

// A text in a field of kBytes bytes, zero-padded.
template <std::size_t kBytes>
struct FixedText {
    std::array<char, kBytes> bytes{};

    FixedText() = default;
    // Cuts what does not fit, at a character's boundary.
    explicit FixedText(std::string_view text) {
        const std::string_view part = utf8_prefix(text, kBytes);
        for (std::size_t i = 0; i < part.size(); ++i) bytes[i] = part[i];
    }
    // Up to the first zero byte.
    [[nodiscard]] std::string_view view() const {
        std::size_t size = 0;
        while (size < kBytes && bytes[size] != '\0') ++size;
        return {bytes.data(), size};
    }
    bool operator==(const FixedText&) const = default;
};

}  // namespace rig
