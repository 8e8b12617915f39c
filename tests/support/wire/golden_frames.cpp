#include "tests/support/wire/golden_frames.hpp"

#include <cstdio>
#include <fstream>
#include <sstream>
#include <string_view>

namespace rig::test {

namespace {

// False when a word is not two hexadecimal digits.
bool append_hex_line(const std::string& line, std::vector<std::byte>& bytes) {
    std::istringstream words(line);
    for (std::string word; words >> word;) {
        if (word.size() != 2 || word.find_first_not_of("0123456789abcdef") != std::string::npos) return false;
        bytes.push_back(static_cast<std::byte>(std::stoi(word, nullptr, 16)));
    }
    return true;
}

}  // namespace

std::vector<GoldenFrame> load_golden_frames() {
    constexpr std::string_view kFence = "```";
    constexpr std::string_view kOpening = "```golden ";
    std::ifstream page("core/wire/PROTOCOL.md");
    std::vector<GoldenFrame> frames;
    bool inside = false;
    for (std::string line; std::getline(page, line);) {
        if (line.starts_with(kOpening)) {
            frames.push_back({line.substr(kOpening.size()), {}});
            inside = true;
        } else if (line.starts_with(kFence)) {
            inside = false;
        } else if (inside && !append_hex_line(line, frames.back().bytes)) {
            return {};
        }
    }
    return frames;
}

std::vector<std::byte> golden_stream(const std::vector<GoldenFrame>& frames) {
    std::vector<std::byte> stream;
    for (const GoldenFrame& frame : frames)
        stream.insert(stream.end(), frame.bytes.begin(), frame.bytes.end());
    return stream;
}

std::string to_hex(const std::vector<std::byte>& bytes) {
    std::string text;
    for (const std::byte byte : bytes) {
        char digits[4];
        std::snprintf(digits, sizeof digits, "%02x ", std::to_integer<unsigned>(byte));
        text += digits;
    }
    return text;
}

}  // namespace rig::test
