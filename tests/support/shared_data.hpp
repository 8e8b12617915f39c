// Finds the recorded data that some tests need and that is not part of the repository: the folder
// `shared/data` beside the source tree, or what the environment's RIG_SHARED_DATA names. Where it is absent,
// such a test is skipped.
#pragma once

#include <filesystem>
#include <string_view>

namespace rig::test {

// The file or folder `relative` of the shared data; an empty path when it is not there.
[[nodiscard]] std::filesystem::path shared_data(std::string_view relative);

}  // namespace rig::test

// Declares `path` in a test body, or skips the test with the reason. Needs <gtest/gtest.h>.
#define RIG_SHARED_DATA_OR_SKIP(variable, relative)                                                          \
    const std::filesystem::path variable = ::rig::test::shared_data(relative);                               \
    if (variable.empty()) {                                                                                  \
        GTEST_SKIP() << "needs " << (relative) << " of ../shared/data (or set RIG_SHARED_DATA to a folder)"; \
    }                                                                                                        \
    static_cast<void>(0)
