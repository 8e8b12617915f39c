// Takes the fields of a table of a board file, each with its type and range. The first fault is kept, with
// its line; what comes after it is read for nothing.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <set>
#include <string>

#define TOML_EXCEPTIONS 0
#include <toml++/toml.h>

namespace rig {

class BoardFields {
  public:
    // `where`: how the table is called in messages, "" or "[[camera]] 'left': ".
    BoardFields(const toml::table& table, std::string where) : table_(table), where_(std::move(where)) {}

    // A field that is not there leaves `into` as it is.
    void text(const char* key, std::string& into, std::size_t least, std::size_t most) {
        const toml::node* node = take(key);
        if (node == nullptr) return;
        const auto value = node->value_exact<std::string>();
        if (value && value->size() >= least && value->size() <= most) {
            into = *value;
        } else {
            refuse(*node, fmt::format("'{}' must have {} to {} bytes, in quotes", key, least, most));
        }
    }
    void number(const char* key, double& into, double low, double high) {
        const toml::node* node = take(key);
        if (node == nullptr) return;
        const auto value = node->is_number() ? node->value<double>() : std::nullopt;
        if (value && *value >= low && *value <= high) {
            into = *value;
        } else {
            refuse(*node, fmt::format("'{}' must be a number, {} to {}", key, low, high));
        }
    }
    void whole(const char* key, int& into, int low, int high) {
        const toml::node* node = take(key);
        if (node == nullptr) return;
        const auto value = node->value_exact<std::int64_t>();
        if (value && *value >= low && *value <= high) {
            into = static_cast<int>(*value);
        } else {
            refuse(*node, fmt::format("'{}' must be a whole number, {} to {}", key, low, high));
        }
    }
    // For what the calls above do not read; none when the key is not there.
    [[nodiscard]] const toml::node* take(const char* key) {
        known_.insert(key);
        return table_.get(key);
    }
    // A key that nobody has taken is a fault.
    void nothing_else() {
        for (const auto& [key, node] : table_) {
            if (!known_.contains(std::string(key.str())))
                refuse(node, fmt::format("there is no key '{}'", std::string(key.str())));
        }
    }
    void refuse(const toml::node& at, const std::string& what) {
        if (fault_.empty()) fault_ = fmt::format("line {}: {}{}", at.source().begin.line, where_, what);
    }
    // A fault of a table inside this one, which has named its line.
    void pass_on(const std::string& fault) {
        if (fault_.empty()) fault_ = fault;
    }
    [[nodiscard]] const toml::table& table() const { return table_; }
    // "" when nothing is wrong so far.
    [[nodiscard]] const std::string& fault() const { return fault_; }

  private:
    const toml::table& table_;
    std::string where_;
    std::set<std::string> known_;
    std::string fault_;
};

}  // namespace rig
