#include "tests/support/shared_data.hpp"

#include <cstdlib>
#include <system_error>

namespace rig::test {

std::filesystem::path shared_data(std::string_view relative) {
    const char* const chosen = std::getenv("RIG_SHARED_DATA");
    const std::filesystem::path folder =
        chosen != nullptr ? std::filesystem::path(chosen)
                          : std::filesystem::path(RIG_SOURCE_FOLDER) / ".." / "shared" / "data";
    std::filesystem::path found = (folder / relative).lexically_normal();
    std::error_code ignored;
    return std::filesystem::exists(found, ignored) ? found : std::filesystem::path();
}

}  // namespace rig::test
