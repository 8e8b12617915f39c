#include "tests/hygiene/lexer.hpp"

#include <algorithm>
#include <cctype>

namespace rig::hygiene {

namespace {

bool is_word(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

bool is_digit(char c) {
    return std::isdigit(static_cast<unsigned char>(c)) != 0;
}

class Lexer {
  public:
    explicit Lexer(std::string_view source) : source_(source) {}

    Lexed run() {
        while (at_ < source_.size()) step();
        return std::move(lexed_);
    }

  private:
    [[nodiscard]] char peek(std::size_t ahead = 0) const {
        return at_ + ahead < source_.size() ? source_[at_ + ahead] : '\0';
    }
    [[nodiscard]] bool starts(std::string_view text) const { return source_.substr(at_).starts_with(text); }

    void skip(std::size_t count) {
        const std::size_t end = std::min(at_ + count, source_.size());
        for (; at_ < end; ++at_) line_ += source_[at_] == '\n' ? 1 : 0;
    }
    void skip_past(std::string_view end) {
        const std::size_t found = source_.find(end, at_);
        skip(found == std::string_view::npos ? source_.size() - at_ : found + end.size() - at_);
    }
    void add(TokenKind kind, std::size_t length) {
        lexed_.tokens.push_back({kind, source_.substr(at_, length), line_, directive_});
        line_start_ = false;
        skip(length);
    }

    void step() {
        const char c = peek();
        if (c == '\n') {
            directive_ = false;
            line_start_ = true;
            skip(1);
        } else if (c == '\\' && peek(1) == '\n') {
            skip(2);
        } else if (std::isspace(static_cast<unsigned char>(c)) != 0) {
            skip(1);
        } else if (starts("//")) {
            skip(std::min(source_.find('\n', at_), source_.size()) - at_);
        } else if (starts("/*")) {
            skip_past("*/");
        } else if (c == '#' && line_start_) {
            directive();
        } else {
            token();
        }
    }

    void token() {
        const char c = peek();
        if (is_digit(c) || (c == '.' && is_digit(peek(1)))) {
            number();
        } else if (is_word(c)) {
            word();
        } else if (c == '"' || c == '\'') {
            quoted(c);
        } else {
            add(TokenKind::kPunctuation, starts("::") || starts("->") ? 2 : 1);
        }
    }

    void number() {
        std::size_t length = 1;
        while (is_word(peek(length)) || peek(length) == '.' ||
               (peek(length) == '\'' && is_word(peek(length + 1))) ||
               ((peek(length) == '+' || peek(length) == '-') && is_exponent(peek(length - 1)))) {
            ++length;
        }
        add(TokenKind::kNumber, length);
    }
    [[nodiscard]] bool is_exponent(char c) const {
        const bool hexadecimal = starts("0x") || starts("0X");
        return c == 'p' || c == 'P' || (!hexadecimal && (c == 'e' || c == 'E'));
    }

    void word() {
        std::size_t length = 1;
        while (is_word(peek(length))) ++length;
        const std::string_view text = source_.substr(at_, length);
        if (peek(length) == '"' && (text == "R" || text == "u8R" || text == "LR")) {
            raw(length);
        } else {
            add(TokenKind::kIdentifier, length);
        }
    }

    void quoted(char quote) {
        std::size_t length = 1;
        while (at_ + length < source_.size() && peek(length) != quote && peek(length) != '\n') {
            length += peek(length) == '\\' ? 2 : 1;
        }
        add(TokenKind::kText, length + 1);
    }

    void raw(std::size_t prefix) {
        const std::size_t open = source_.find('(', at_);
        if (open == std::string_view::npos) return add(TokenKind::kText, source_.size() - at_);
        const std::string end =
            ")" + std::string(source_.substr(at_ + prefix + 1, open - at_ - prefix - 1)) + "\"";
        const std::size_t close = source_.find(end, open);
        add(TokenKind::kText,
            close == std::string_view::npos ? source_.size() - at_ : close + end.size() - at_);
    }

    void directive() {
        skip(1);
        while (peek() == ' ') skip(1);
        directive_ = true;
        if (!starts("include")) return;
        const std::string_view rest = source_.substr(at_, source_.find('\n', at_) - at_);
        const std::size_t open = rest.find_first_of("<\"");
        const std::size_t close = open == std::string_view::npos ? open : rest.find_first_of(">\"", open + 1);
        if (close != std::string_view::npos) {
            lexed_.includes.push_back({rest.substr(open + 1, close - open - 1), rest[open] == '<', line_});
        }
        skip(rest.size());
    }

    std::string_view source_;
    Lexed lexed_;
    std::size_t at_ = 0;
    int line_ = 1;
    bool line_start_ = true;
    bool directive_ = false;
};

}  // namespace

Lexed lex(std::string_view source) {
    return Lexer(source).run();
}

}  // namespace rig::hygiene
