#include "tests/hygiene/exceptions.hpp"

#include <array>

namespace rig::hygiene {

std::span<const Exception> all_exceptions() {
    static constexpr std::array kExceptions{
        Exception{"core_headers", "core/pipeline/pipeline.hpp",
                  "owns the stages' state: one allocation in the constructor, none after"},
        Exception{"core_words", "core/pipeline/pipeline.hpp",
                  "owns the stages' state: one allocation in the constructor, none after"},
    };
    return kExceptions;
}

}  // namespace rig::hygiene
