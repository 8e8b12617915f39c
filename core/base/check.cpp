#include "core/base/check.hpp"

namespace rig {

[[gnu::weak]] void check_failed(const char*, int, const char*) {
    __builtin_trap();
}

}  // namespace rig
