// Where a rule of the house is not kept, and why. Every entry must still be needed: one that excuses nothing
// fails.
#pragma once

#include <span>
#include <string_view>

namespace rig::hygiene {

struct Exception {
    std::string_view rule;
    std::string_view path;
    std::string_view reason;
};

[[nodiscard]] std::span<const Exception> all_exceptions();

}  // namespace rig::hygiene
