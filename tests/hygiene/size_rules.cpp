#include "tests/hygiene/rules.hpp"
#include "tests/hygiene/scopes.hpp"

namespace rig::hygiene {

Violations file_lengths(const SourceTree& tree) {
    Violations violations;
    for (const auto& [path, file] : tree.files()) {
        const std::size_t count = file.lines().size();
        if (count > kMaxFileLines) violations.push_back({path, 0, std::to_string(count) + " lines"});
    }
    return violations;
}

Violations function_lengths(const SourceTree& tree) {
    Violations violations;
    for (const auto& [path, file] : tree.files()) {
        for (const Function& function : find_scopes(file.code.tokens).functions) {
            if (function.lines() <= kMaxFunctionLines) continue;
            violations.push_back({path, function.first_line,
                                  function.name + ": " + std::to_string(function.lines()) + " lines"});
        }
    }
    return violations;
}

FunctionSizes measure_functions(const SourceTree& tree) {
    FunctionSizes sizes;
    for (const auto& [path, file] : tree.files()) {
        if (file.is_under("tests")) continue;
        for (const Function& function : find_scopes(file.code.tokens).functions) {
            ++sizes.total;
            sizes.under_ten += function.lines() < kShortFunctionLines ? 1 : 0;
        }
    }
    return sizes;
}

}  // namespace rig::hygiene
