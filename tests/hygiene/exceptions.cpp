#include "tests/hygiene/exceptions.hpp"

#include <array>

namespace rig::hygiene {

std::span<const Exception> all_exceptions() {
    static constexpr std::array kExceptions{
        Exception{"function_lengths", "core/pack/pack_error.cpp",
                  "one switch of texts: the compiler finds a missing one"},
    };
    return kExceptions;
}

}  // namespace rig::hygiene
