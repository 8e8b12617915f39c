#include <algorithm>
#include <array>
#include <map>
#include <string_view>

#include "tests/hygiene/rules.hpp"
#include "tests/hygiene/scopes.hpp"

namespace rig::hygiene {

namespace {

constexpr std::string_view kLibm = "libm differs between C libraries: core/base/math.hpp";
constexpr std::string_view kHeap = "no heap: capacities of core/limits.hpp";
constexpr std::string_view kThrow = "no exceptions: Result, or RIG_CHECK for our own bugs";
constexpr std::string_view kRtti = "no RTTI";
constexpr std::string_view kThreads = "no threads: the programs own them";
constexpr std::string_view kTime = "no clock: timestamps are arguments";
constexpr std::string_view kRandom = "no randomness: a run must repeat";
constexpr std::string_view kOutput = "no output: reports are returned";
constexpr std::string_view kEnd = "no way out of the process but RIG_CHECK";

// Wrong wherever they stand.
const std::map<std::string_view, std::string_view> kWords{
    {"malloc", kHeap},
    {"calloc", kHeap},
    {"realloc", kHeap},
    {"aligned_alloc", kHeap},
    {"unique_ptr", kHeap},
    {"shared_ptr", kHeap},
    {"make_unique", kHeap},
    {"make_shared", kHeap},
    {"stable_sort", kHeap},
    {"inplace_merge", kHeap},
    {"stable_partition", kHeap},
    {"pmr", kHeap},
    {"MatrixXd", kHeap},
    {"MatrixXf", kHeap},
    {"VectorXd", kHeap},
    {"VectorXf", kHeap},
    {"throw", kThrow},
    {"try", kThrow},
    {"catch", kThrow},
    {"dynamic_cast", kRtti},
    {"typeid", kRtti},
    {"thread_local", kThreads},
    {"mutex", kThreads},
    {"chrono", kTime},
    {"mt19937", kRandom},
    {"random_device", kRandom},
    {"cout", kOutput},
    {"cerr", kOutput},
    {"ostream", kOutput},
    {"errno", "errno stops in hal/linux"},
    {"goto", "structured control flow only"},
    {"Dynamic", "Eigen in core is of fixed size"},
};

// Wrong after std::.
const std::map<std::string_view, std::string_view> kStd{
    {"string", kHeap},    {"vector", kHeap},    {"map", kHeap},      {"set", kHeap},
    {"deque", kHeap},     {"list", kHeap},      {"function", kHeap}, {"any", kHeap},
    {"thread", kThreads}, {"atomic", kThreads}, {"time", kTime},     {"clock", kTime},
};

// Wrong as a call. Those of core/base/math.hpp are right without std::.
const std::map<std::string_view, std::string_view> kCalls{
    {"free", kHeap},      {"rand", kRandom}, {"srand", kRandom},    {"time", kTime},  {"clock", kTime},
    {"getenv", kEnd},     {"exit", kEnd},    {"abort", kEnd},       {"assert", kEnd}, {"printf", kOutput},
    {"fprintf", kOutput}, {"puts", kOutput}, {"snprintf", kOutput},
};

constexpr std::array<std::string_view, 41> kLibmNames{
    "sin",    "cos",   "tan",       "asin",   "acos",      "atan", "atan2", "sinh",   "cosh",
    "tanh",   "asinh", "acosh",     "atanh",  "exp",       "exp2", "expm1", "log",    "log2",
    "log10",  "log1p", "pow",       "cbrt",   "hypot",     "erf",  "erfc",  "tgamma", "lgamma",
    "fma",    "fmod",  "remainder", "remquo", "nearbyint", "rint", "lrint", "llrint", "round",
    "lround", "floor", "ceil",      "trunc",  "sincos"};
constexpr std::array<std::string_view, 3> kOwnMath{"exp", "atan2", "sin_cos"};

template <class List>
bool contains(const List& list, std::string_view word) {
    return std::find(list.begin(), list.end(), word) != list.end();
}

bool is_libm(std::string_view word) {
    if (contains(kLibmNames, word)) return true;
    const bool suffixed = word.size() > 2 && (word.back() == 'f' || word.back() == 'l');
    const std::string_view stem = word.substr(0, word.size() - 1);
    return suffixed && contains(kLibmNames, stem);
}

struct Place {
    std::string_view before;   // the token before the word
    std::string_view before2;  // and the one before that
    std::string_view after;
};

std::string_view fault_of_call(std::string_view word, const Place& place) {
    const bool member = place.before == "." || place.before == "->";
    const bool qualified = place.before == "::";
    const bool global =
        qualified && (place.before2 == "std" || place.before2.empty() || place.before2 == "(" ||
                      place.before2 == "=" || place.before2 == "return");
    if (member || (qualified && !global)) return {};
    if (const auto call = kCalls.find(word); call != kCalls.end()) return call->second;
    if (is_libm(word) && (global || !contains(kOwnMath, word))) return kLibm;
    if (word.starts_with("__builtin_") && is_libm(word.substr(10))) return kLibm;
    return {};
}

std::string_view fault_of(std::string_view word, const Place& place) {
    if (word == "new") return kHeap;
    if (word == "delete" && place.before != "=") return kHeap;
    if (const auto found = kWords.find(word); found != kWords.end()) return found->second;
    if (place.before == "::" && place.before2 == "std") {
        if (const auto found = kStd.find(word); found != kStd.end()) return found->second;
    }
    return place.after == "(" ? fault_of_call(word, place) : std::string_view();
}

}  // namespace

Violations core_words(const SourceTree& tree) {
    Violations violations;
    for (const auto& [path, file] : tree.files()) {
        if (!file.is_under("core")) continue;
        const std::vector<Token>& tokens = file.code.tokens;
        const auto text = [&](std::size_t i) {
            return i < tokens.size() ? tokens[i].text : std::string_view();
        };
        for (std::size_t i = 0; i < tokens.size(); ++i) {
            if (tokens[i].kind != TokenKind::kIdentifier) continue;
            const std::string_view reason = fault_of(tokens[i].text, {text(i - 1), text(i - 2), text(i + 1)});
            if (!reason.empty()) {
                violations.push_back(
                    {path, tokens[i].line, std::string(tokens[i].text) + ": " + std::string(reason)});
            }
        }
    }
    return violations;
}

Violations core_globals(const SourceTree& tree) {
    Violations violations;
    for (const auto& [path, file] : tree.files()) {
        if (!file.is_under("core")) continue;
        const Scopes scopes = find_scopes(file.code.tokens);
        for (const Variable& variable : scopes.mutable_globals) {
            violations.push_back({path, variable.line, "mutable global: " + variable.name});
        }
        for (const Variable& variable : scopes.mutable_statics) {
            violations.push_back({path, variable.line, "mutable static: " + variable.name});
        }
    }
    return violations;
}

}  // namespace rig::hygiene
