#include "tests/unit/firmware_host/companion/commands/verb_run.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "firmware_host/companion/commands/verbs.hpp"

namespace rig::test {

VerbOutcome run_verb(void (*add)(CLI::App&, int&), std::vector<std::string> arguments) {
    CLI::App app;
    VerbOutcome outcome;
    add(app, outcome.exit_code);
    std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them from the back
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    try {
        app.parse(arguments);
    } catch (const CLI::ParseError& error) {
        outcome.exit_code = error.get_exit_code() == 0 ? 0 : host::kExitUsage;
    }
    std::fflush(nullptr);
    outcome.out = testing::internal::GetCapturedStdout();
    outcome.err = testing::internal::GetCapturedStderr();
    return outcome;
}

}  // namespace rig::test
