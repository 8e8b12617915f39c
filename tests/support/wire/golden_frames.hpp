// The golden vectors of core/wire/PROTOCOL.md, read from that page.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace rig::test {

struct GoldenFrame {
    std::string name;
    std::vector<std::byte> bytes;  // a whole frame, delimiters included
};

// Every block "```golden <name>" of the page, in its order. Empty when the page cannot be read or a block is
// malformed.
[[nodiscard]] std::vector<GoldenFrame> load_golden_frames();

// All of them, one after another.
[[nodiscard]] std::vector<std::byte> golden_stream(const std::vector<GoldenFrame>& frames);

[[nodiscard]] std::string to_hex(const std::vector<std::byte>& bytes);

}  // namespace rig::test
