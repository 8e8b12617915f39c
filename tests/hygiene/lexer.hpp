// Splits C++ source into tokens and includes, enough to check rules on words, scopes and lengths. Not a
// compiler: it knows neither types nor macros' meanings.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace rig::hygiene {

enum class TokenKind { kIdentifier, kNumber, kText, kPunctuation };

// Keywords are identifiers. `::` and `->` are one token each, all other punctuation is one character.
// Comments leave none.
struct Token {
    TokenKind kind = TokenKind::kPunctuation;
    std::string_view text;
    int line = 1;
    bool in_directive = false;  // part of a preprocessor line
};

struct Include {
    std::string_view path;
    bool angled = false;
    int line = 1;
};

struct Lexed {
    std::vector<Token> tokens;
    std::vector<Include> includes;
};

// The views point into `source`.
[[nodiscard]] Lexed lex(std::string_view source);

}  // namespace rig::hygiene
