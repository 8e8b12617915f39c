#include "core/base/check.hpp"

#include <gtest/gtest.h>

#include <string>

#include "core/base/bounded_vector.hpp"

namespace {

struct CheckFailure {
    std::string file;
    int line = 0;
    std::string condition;
};

}  // namespace

namespace rig {

// A strong definition replaces the trapping one of core.
void check_failed(const char* file, int line, const char* condition) {
    throw CheckFailure{file, line, condition};
}

}  // namespace rig

namespace {

TEST(Check, TellsWhereAndWhat) {
    int line = 0;
    try {
        line = __LINE__ + 1;
        RIG_CHECK(1 + 1 == 3);
        FAIL() << "the check let a false condition pass";
    } catch (const CheckFailure& failure) {
        EXPECT_TRUE(failure.file.ends_with("check_test.cpp")) << failure.file;
        EXPECT_EQ(failure.line, line);
        EXPECT_EQ(failure.condition, "1 + 1 == 3");
    }
}

TEST(Check, EvaluatesItsConditionOnce) {
    int evaluations = 0;
    RIG_CHECK(++evaluations > 0);
    EXPECT_EQ(evaluations, 1);
}

TEST(Check, IsOneStatement) {
    bool other = false;
    if (other)
        RIG_CHECK(false);
    else
        other = true;
    EXPECT_TRUE(other);
}

TEST(Check, IsOnInEveryBuild) {
    // NDEBUG is defined in the release preset and must make no difference.
    EXPECT_THROW(RIG_CHECK(false), CheckFailure);
}

TEST(Check, GuardsTheBoundsOfContainers) {
    rig::BoundedVector<int, 2> items;
    EXPECT_THROW(static_cast<void>(items[0]), CheckFailure);
    EXPECT_THROW(items.pop_back(), CheckFailure);
    EXPECT_THROW(items.resize(3), CheckFailure);
}

}  // namespace
