// Why a message could not be written or was refused.
#pragma once

#include <cstdint>

namespace rig {

enum class WireError : std::uint8_t {
    kSpace,    // the caller's span is too small for the result
    kLength,   // the payload is shorter or longer than its own fields say
    kRange,    // a field is outside its documented range, or a reserved bit is set
    kVersion,  // the other side speaks no protocol that we speak
    kText,     // a text is not printable UTF-8, or too long
};

}  // namespace rig
