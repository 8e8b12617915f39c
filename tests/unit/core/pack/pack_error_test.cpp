#include "core/pack/pack_error.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace rig {
namespace {

TEST(PackErrorText, EveryErrorHasItsOwnPlainSentence) {
    std::set<std::string> seen;
    for (int i = 0; i < static_cast<int>(PackError::kCount); ++i) {
        const std::string text{pack_error_text(static_cast<PackError>(i))};
        EXPECT_GT(text.size(), 15U);
        EXPECT_NE(text, "unknown pack error") << i;
        EXPECT_NE(text.back(), '.') << text;
        EXPECT_TRUE(seen.insert(text).second) << text;
    }
}

TEST(PackErrorText, AnyOtherValueIsSafe) {
    EXPECT_EQ(pack_error_text(static_cast<PackError>(250)), "unknown pack error");
}

}  // namespace
}  // namespace rig
