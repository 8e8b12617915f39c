// The reader under the rules: tokens, function bodies and variables of awkward C++.
#include "tests/hygiene/scopes.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace rig::hygiene {
namespace {

std::vector<std::string> words(const std::string& source) {
    std::vector<std::string> result;
    for (const Token& token : lex(source).tokens) {
        if (token.kind == TokenKind::kIdentifier) result.emplace_back(token.text);
    }
    return result;
}

std::vector<std::string> functions(const std::string& source) {
    std::vector<std::string> result;
    const Lexed lexed = lex(source);
    for (const Function& function : find_scopes(lexed.tokens).functions) {
        result.push_back(function.name + ":" + std::to_string(function.lines()));
    }
    return result;
}

using Names = std::vector<std::string>;

TEST(Lexer, LeavesCommentsAndTextOut) {
    EXPECT_EQ(words("a // b\n/* c\n d */ e \"f \\\" g\" 'h' i"), (Names{"a", "e", "i"}));
    EXPECT_EQ(words("a R\"x(b \" c)\" d)x\" e"), (Names{"a", "e"}));
}

TEST(Lexer, KeepsNumbersWhole) {
    EXPECT_EQ(words("1'000 0x1p-53 1e-6f 0xE+b 2.5F c"), (Names{"b", "c"}));
}

TEST(Lexer, FindsIncludesAndLines) {
    const Lexed lexed = lex("#include <array>\n#  include \"a/b.hpp\"  // why\nint\nx;");
    ASSERT_EQ(lexed.includes.size(), 2U);
    EXPECT_TRUE(lexed.includes[0].angled);
    EXPECT_EQ(lexed.includes[1].path, "a/b.hpp");
    EXPECT_EQ(lexed.includes[1].line, 2);
    EXPECT_EQ(lexed.tokens[1].line, 4);
}

TEST(Lexer, EndsOnUnfinishedInput) {
    for (const char* text :
         {"\"abc", "/* abc", "R\"(abc", "R\"abc", "'", "#include <", "#include", "\\", "a\\\n"}) {
        static_cast<void>(lex(text));
        static_cast<void>(find_scopes(lex(text).tokens));
    }
}

TEST(FunctionFinder, FindsPlainOnes) {
    EXPECT_EQ(functions("int f() {\n}\nvoid g(int a = 3, X b = {1}) {\n}\n"), (Names{"f:2", "g:2"}));
    EXPECT_EQ(functions("namespace a::b {\nint f() { return 1; }\n}\nint g();\n"), (Names{"f:1"}));
    EXPECT_EQ(functions("extern \"C\" int f() {\n}\nextern \"C\" {\nint g() {\n}\n}\n"),
              (Names{"f:2", "g:2"}));
}

TEST(FunctionFinder, FindsMembers) {
    EXPECT_EQ(functions("class A : public B {\n  public:\n    A() : x_{1}, y_(2) {\n    }\n    int f() const "
                        "{ return {}; }\n"
                        "    int y = g();\n};\n"),
              (Names{"A:2", "f:1"}));
    EXPECT_EQ(functions("struct alignas(64) A {\n    bool operator==(const A& o) const {\n        return "
                        "true;\n    }\n};\n"),
              (Names{"=:3"}));
    EXPECT_EQ(functions("A::A(int x)\n    : x_{x},\n      y_{} {\n    f();\n}\n"), (Names{"A:5"}));
}

TEST(FunctionFinder, FindsTemplates) {
    EXPECT_EQ(
        functions(
            "template <class T = int, int N = 3>\n    requires(N == 3)\nT f(T t) {\n    return t;\n}\n"),
        (Names{"f:5"}));
    EXPECT_EQ(functions("template <class T>\nclass A {\n    T f() { return T{}; }\n};\n"), (Names{"f:1"}));
}

TEST(FunctionFinder, CountsLambdasWithTheirFunction) {
    EXPECT_EQ(functions("void f() {\n    auto g = [](int x) {\n        return x;\n    };\n}\n"),
              (Names{"f:5"}));
    EXPECT_EQ(functions("const auto kG = [](int x) {\n    return x;\n};\nint h() { return 1; }\n"),
              (Names{"h:1"}));
}

TEST(VariableFinder, TellsGlobalsFromTheRest) {
    const auto globals = [](const std::string& source) {
        Names result;
        const Lexed lexed = lex(source);
        for (const Variable& variable : find_scopes(lexed.tokens).mutable_globals)
            result.push_back(variable.name);
        return result;
    };
    EXPECT_EQ(globals("int a; std::array<int, 3> b{}; static double c = 1; int d[3]; namespace x { int* e = "
                      "nullptr; }"),
              (Names{"a", "b", "c", "d", "e"}));
    EXPECT_EQ(globals("const int a = 1; constexpr int b = 2; int f(int); struct S { int x; }; enum E { k };"),
              (Names{}));
    EXPECT_EQ(globals("using T = int; int f() { int local; return local; } static_assert(1 + 1 == 2);"),
              (Names{}));
}

}  // namespace
}  // namespace rig::hygiene
