// The rules of the house, each a function from the tree to what breaks it. Not here: layout of code, which is
// clang-format's, and bugs, which are clang-tidy's and the tests'.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tests/hygiene/source_tree.hpp"

namespace rig::hygiene {

struct Violation {
    std::string path;
    int line = 0;  // 0: the file as a whole
    std::string what;
};

using Violations = std::vector<Violation>;

struct Rule {
    std::string_view name;
    Violations (*check)(const SourceTree&);
};

[[nodiscard]] std::span<const Rule> all_rules();

// include_rules.cpp
[[nodiscard]] Violations include_spelling(const SourceTree& tree);    // from the root, and the file exists
[[nodiscard]] Violations include_directions(const SourceTree& tree);  // rooms see only what is below them
[[nodiscard]] Violations core_headers(const SourceTree& tree);    // standard headers that core may include
[[nodiscard]] Violations backend_naming(const SourceTree& tree);  // only wiring.cpp names concrete backends

// core_rules.cpp
[[nodiscard]] Violations core_words(
    const SourceTree& tree);  // no heap, exceptions, libm, streams, clocks, randomness
[[nodiscard]] Violations core_globals(const SourceTree& tree);  // no mutable globals or statics

// name_rules.cpp
[[nodiscard]] Violations product_name(const SourceTree& tree);  // in no identifier
[[nodiscard]] Violations empty_names(const SourceTree& tree);   // Impl, Manager, Helper, Utils

// size_rules.cpp
inline constexpr int kMaxFileLines = 600;
inline constexpr int kMaxFunctionLines = 70;
inline constexpr int kShortFunctionLines = 10;
[[nodiscard]] Violations file_lengths(const SourceTree& tree);
[[nodiscard]] Violations function_lengths(const SourceTree& tree);
struct FunctionSizes {
    int total = 0;
    int under_ten = 0;
};
[[nodiscard]] FunctionSizes measure_functions(const SourceTree& tree);

// text_rules.cpp
[[nodiscard]] Violations whitespace(
    const SourceTree& tree);  // no tabs, trailing blanks, carriage returns; ends with a newline
[[nodiscard]] Violations machine_paths(const SourceTree& tree);  // nothing of the machine it was written on
[[nodiscard]] Violations header_form(const SourceTree& tree);    // opens with a comment, has #pragma once

// layout_rules.cpp
[[nodiscard]] Violations unit_tests(
    const SourceTree& tree);  // every core/x.cpp has tests/unit/core/x_test.cpp
[[nodiscard]] Violations listed_sources(
    const SourceTree& tree);  // every .cpp is named by its folder's CMakeLists.txt
[[nodiscard]] Violations folder_readmes(const SourceTree& tree);  // at most a page, ends with Decisions
[[nodiscard]] Violations fault_codes(const SourceTree& tree);  // F01..F55 once each in core/base/faults.hpp
[[nodiscard]] Violations readme_commands(const SourceTree& tree);  // .ci/run runs every command of README.md

}  // namespace rig::hygiene
