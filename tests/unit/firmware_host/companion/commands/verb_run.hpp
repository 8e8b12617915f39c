// Runs one verb in this process, as a script would.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace rig::test {

struct VerbOutcome {
    int exit_code = -1;
    std::string out;
    std::string err;
};

// `add` is one of commands/verbs.hpp, `arguments` what follows the program's name, the verb first.
[[nodiscard]] VerbOutcome run_verb(void (*add)(CLI::App&, int&), std::vector<std::string> arguments);

}  // namespace rig::test
