// Where functions begin and end, and which variables live outside them, found from braces and statement
// heads.
#pragma once

#include <string>
#include <vector>

#include "tests/hygiene/lexer.hpp"

namespace rig::hygiene {

struct Function {
    std::string name;    // the word before its parameter list
    int first_line = 1;  // of its declaration
    int last_line = 1;   // of its closing brace
    [[nodiscard]] int lines() const { return last_line - first_line + 1; }
};

struct Variable {
    std::string name;
    int line = 1;
};

struct Scopes {
    std::vector<Function> functions;  // bodies at namespace and class scope; a lambda belongs to its function
    std::vector<Variable> mutable_globals;  // at namespace scope, neither const nor constexpr
    std::vector<Variable> mutable_statics;  // `static` inside a function, neither const nor constexpr
};

[[nodiscard]] Scopes find_scopes(const std::vector<Token>& tokens);

}  // namespace rig::hygiene
