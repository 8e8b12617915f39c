#include "tests/hygiene/exceptions.hpp"

#include <array>

namespace rig::hygiene {

std::span<const Exception> all_exceptions() {
    static constexpr std::array kExceptions{
        Exception{"function_lengths", "core/pack/pack_error.cpp",
                  "one switch of texts: the compiler finds a missing one"},
        Exception{"empty_names", "firmware_host/companion/capture/picture_stream.cpp",
                  "OpenCV's own namespace, to silence its log: the errors are said by us"},
    };
    return kExceptions;
}

}  // namespace rig::hygiene
