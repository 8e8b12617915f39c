#include <gtest/gtest.h>

#include <cstdio>
#include <ostream>
#include <string>

#include "tests/hygiene/exceptions.hpp"
#include "tests/hygiene/rules.hpp"

namespace rig::hygiene {

// What GoogleTest prints for a parameter.
void PrintTo(const Rule& rule, std::ostream* out) {
    *out << rule.name;
}

namespace {

const SourceTree& tree() {
    static const SourceTree kTree = SourceTree::load(RIG_SOURCE_FOLDER);
    return kTree;
}

bool is_excused(std::string_view rule, const Violation& violation) {
    for (const Exception& exception : all_exceptions()) {
        if (exception.rule == rule && exception.path == violation.path) return true;
    }
    return false;
}

class House : public testing::TestWithParam<Rule> {};

TEST_P(House, KeepsTheRule) {
    for (const Violation& violation : GetParam().check(tree())) {
        if (is_excused(GetParam().name, violation)) continue;
        ADD_FAILURE() << violation.path << ":" << violation.line << ": " << violation.what;
    }
}

TEST_P(House, NeedsItsExceptions) {
    const Violations violations = GetParam().check(tree());
    for (const Exception& exception : all_exceptions()) {
        if (exception.rule != GetParam().name) continue;
        bool needed = false;
        for (const Violation& violation : violations) needed = needed || violation.path == exception.path;
        EXPECT_TRUE(needed) << exception.path << " keeps " << exception.rule << " now: remove its exception";
        EXPECT_FALSE(exception.reason.empty()) << exception.path;
    }
}

INSTANTIATE_TEST_SUITE_P(Rules, House, testing::ValuesIn(all_rules().begin(), all_rules().end()),
                         [](const auto& rule) { return std::string(rule.param.name); });

TEST(HouseFacts, WasRead) {
    EXPECT_NE(tree().find("core/limits.hpp"), nullptr);
    EXPECT_NE(tree().find("tests/hygiene/tree_test.cpp"), nullptr);
    EXPECT_GT(tree().files().size(), 50U);
}

TEST(HouseFacts, ExceptionsNameARule) {
    for (const Exception& exception : all_exceptions()) {
        bool known = false;
        for (const Rule& rule : all_rules()) known = known || rule.name == exception.rule;
        EXPECT_TRUE(known) << exception.rule;
    }
}

// Reported, not asserted: the aim is that half of the functions are under ten lines.
TEST(HouseFacts, FunctionSizes) {
    const FunctionSizes sizes = measure_functions(tree());
    ASSERT_GT(sizes.total, 0);
    std::printf("functions under %d lines: %d of %d (%d %%)\n", kShortFunctionLines, sizes.under_ten,
                sizes.total, 100 * sizes.under_ten / sizes.total);
    RecordProperty("under_ten_percent", 100 * sizes.under_ten / sizes.total);
}

}  // namespace
}  // namespace rig::hygiene
