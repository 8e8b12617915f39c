#include "tests/hygiene/scopes.hpp"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <string_view>

namespace rig::hygiene {

namespace {

enum class Opens { kNamespace, kType, kFunction, kValue };

class ScopeFinder {
  public:
    explicit ScopeFinder(const std::vector<Token>& tokens) {
        for (const Token& token : tokens) {
            if (!token.in_directive) tokens_.push_back(&token);
        }
    }

    Scopes run() {
        for (; at_ < tokens_.size(); ++at_) {
            const std::string_view text = tokens_[at_]->text;
            if (text == ";") {
                end_statement();
            } else if (text == "{") {
                open();
            } else if (text == "}") {
                if (!types_.empty()) types_.pop_back();
                head_ = at_ + 1;
            } else if (text == ":" && at_ > head_ && is_access(tokens_[at_ - 1]->text)) {
                head_ = at_ + 1;
            }
        }
        return scopes_;
    }

  private:
    static bool is_access(std::string_view word) {
        return word == "public" || word == "private" || word == "protected";
    }

    [[nodiscard]] bool head_has(std::initializer_list<std::string_view> words) const {
        for (std::size_t i = head_; i < at_; ++i) {
            if (std::find(words.begin(), words.end(), tokens_[i]->text) != words.end()) return true;
        }
        return false;
    }

    // Where the head goes on after its `template <...>` parts.
    [[nodiscard]] std::size_t after_template() const {
        std::size_t i = head_;
        while (i + 1 < at_ && tokens_[i]->text == "template") {
            int depth = 0;
            for (++i; i < at_; ++i) {
                if (tokens_[i]->text == "<") ++depth;
                if (tokens_[i]->text == ">" && --depth == 0) break;
            }
            ++i;
        }
        return i;
    }

    // Index of the first `text` of the head outside brackets and template parameters, or at_. A parenthesis
    // that belongs to a specifier does not count as one of parameters.
    [[nodiscard]] std::size_t find_outside(std::string_view text) const {
        constexpr std::array<std::string_view, 4> kSpecifiers{"alignas", "decltype", "noexcept", "requires"};
        int depth = 0;
        for (std::size_t i = after_template(); i < at_; ++i) {
            const std::string_view token = tokens_[i]->text;
            const bool specifier =
                token == "(" && i > head_ &&
                std::find(kSpecifiers.begin(), kSpecifiers.end(), tokens_[i - 1]->text) != kSpecifiers.end();
            if (depth == 0 && token == text && !specifier) return i;
            if (token == "(" || token == "[") ++depth;
            if (token == ")" || token == "]") --depth;
        }
        return at_;
    }

    [[nodiscard]] bool inside_parentheses() const {
        int depth = 0;
        for (std::size_t i = head_; i < at_; ++i)
            depth += tokens_[i]->text == "(" ? 1 : tokens_[i]->text == ")" ? -1 : 0;
        return depth > 0;
    }

    [[nodiscard]] Opens kind_of_brace() const {
        if (inside_parentheses()) return Opens::kValue;  // a default argument
        const std::size_t parameters = find_outside("(");
        const std::size_t assignment = find_outside("=");
        if (head_has({"namespace"}) || (head_has({"extern"}) && parameters == at_ && assignment == at_))
            return Opens::kNamespace;
        if (parameters < at_ && (assignment == at_ || head_has({"operator"}))) {
            // A member initialiser's brace follows a name; a body's brace follows ), } or a specifier.
            const std::size_t colon = find_outside(":");
            const Token& before = *tokens_[at_ - 1];
            const bool in_initialisers = colon < at_ && colon > parameters;
            const bool follows_name = before.kind == TokenKind::kIdentifier || before.text == ">";
            return in_initialisers && follows_name ? Opens::kValue : Opens::kFunction;
        }
        if (assignment == at_ && head_has({"class", "struct", "union", "enum"})) return Opens::kType;
        return Opens::kValue;
    }

    void open() {
        switch (kind_of_brace()) {
            case Opens::kNamespace:
                enter(false);
                break;
            case Opens::kType:
                enter(true);
                break;
            case Opens::kFunction:
                function();
                break;
            case Opens::kValue:
                at_ = matching_brace();
                break;  // still the same statement
        }
    }

    void enter(bool type) {
        types_.push_back(type);
        head_ = at_ + 1;
    }

    void function() {
        const std::size_t parameters = find_outside("(");
        const std::size_t open = at_;
        const std::size_t close = matching_brace();
        const std::string name =
            parameters > head_ ? std::string(tokens_[parameters - 1]->text) : std::string();
        scopes_.functions.push_back({name, tokens_[head_]->line, tokens_[close]->line});
        find_statics(open, close);
        at_ = close;
        head_ = close + 1;
    }

    void find_statics(std::size_t open, std::size_t close) {
        for (std::size_t i = open; i < close; ++i) {
            if (tokens_[i]->text != "static") continue;
            const std::string_view next = tokens_[i + 1]->text;
            if (next != "const" && next != "constexpr" && next != "constinit") {
                scopes_.mutable_statics.push_back({std::string(next), tokens_[i]->line});
            }
        }
    }

    [[nodiscard]] std::size_t matching_brace() const {
        int depth = 0;
        for (std::size_t i = at_; i < tokens_.size(); ++i) {
            if (tokens_[i]->text == "{") ++depth;
            if (tokens_[i]->text == "}" && --depth == 0) return i;
        }
        return tokens_.size() - 1;
    }

    [[nodiscard]] bool in_type() const { return !types_.empty() && types_.back(); }

    // The word before the first of = { [ ; of the head.
    [[nodiscard]] std::string variable_name() const {
        const std::size_t end = std::min({find_outside("="), find_outside("{"), find_outside("["), at_});
        return end > head_ ? std::string(tokens_[end - 1]->text) : std::string();
    }

    void end_statement() {
        constexpr std::array<std::string_view, 13> kNotVariables{
            "using",   "namespace", "struct",        "class",  "enum",    "union",    "template",
            "typedef", "friend",    "static_assert", "extern", "concept", "constexpr"};
        if (!in_type() && at_ > head_ + 1) {
            const std::size_t assignment = find_outside("=");
            const std::size_t parameters = find_outside("(");
            const bool declares_function = parameters < assignment;
            const bool other = std::any_of(kNotVariables.begin(), kNotVariables.end(),
                                           [&](auto word) { return head_has({word}); });
            if (!declares_function && !other && !head_has({"const"})) {
                scopes_.mutable_globals.push_back({variable_name(), tokens_[head_]->line});
            }
        }
        head_ = at_ + 1;
    }

    std::vector<const Token*> tokens_;
    std::vector<bool> types_;  // of the open scopes: true for a class, false for a namespace
    Scopes scopes_;
    std::size_t at_ = 0;
    std::size_t head_ = 0;  // where the current statement began
};

}  // namespace

Scopes find_scopes(const std::vector<Token>& tokens) {
    return ScopeFinder(tokens).run();
}

}  // namespace rig::hygiene
