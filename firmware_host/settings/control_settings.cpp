#include "firmware_host/settings/control_settings.hpp"

#include <algorithm>
#include <charconv>
#include <optional>

namespace rig {

namespace {

struct Word {
    std::string_view text;
    ControlKind kind;
};

constexpr std::array kWords{
    Word{"sparsity", ControlKind::kSparsity}, Word{"ridge", ControlKind::kRidge},
    Word{"temporal", ControlKind::kTemporal}, Word{"multiplier", ControlKind::kMultiplier},
    Word{"offset", ControlKind::kOffset},     Word{"range", ControlKind::kRange},
    Word{"symmetry", ControlKind::kSymmetry}, Word{"cancel", ControlKind::kCancel}};

std::unexpected<std::string> refuse(std::string_view line, const std::string& fault) {
    return failure("'" + std::string(line) + "': " + fault);
}

std::optional<float> number(std::string_view text) {
    while (text.starts_with(' ')) text.remove_prefix(1);
    while (text.ends_with(' ')) text.remove_suffix(1);
    float value = 0.0F;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return value;
}

ControlEdit pair_edit(ControlKind kind, std::size_t first, std::size_t second, float value) {
    return {kind, value, 0.0F, static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(second), {}};
}

// A,B: exactly two shapes of this rig.
Result<SidePair, std::string> two_shapes(std::string_view who, ShapeNames names) {
    const std::size_t comma = who.find(',');
    const auto index = [&](std::string_view name) {
        return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
    };
    const SidePair pair{index(who.substr(0, comma)), index(who.substr(comma + 1))};
    if (pair.left >= names.size() || pair.right >= names.size() || pair.left == pair.right)
        return failure("'" + std::string(who) + "' must be two shapes of this rig, with a comma between");
    return pair;
}

Result<std::vector<ControlEdit>, std::string> pair_edits(ControlKind kind, std::string_view who, float value,
                                                         ShapeNames names) {
    if (kind == ControlKind::kCancel || who.find(',') != std::string_view::npos) {
        const auto pair = two_shapes(who, names);
        if (!pair) return failure(pair.error());
        return std::vector{pair_edit(kind, pair->left, pair->right, value)};
    }
    const auto selected = select_shapes(who, names);
    if (!selected) return failure(selected.error());
    const auto has = [&](std::size_t i) { return std::binary_search(selected->begin(), selected->end(), i); };
    std::vector<ControlEdit> edits;
    for (const SidePair& pair : side_pairs(names)) {
        if (has(pair.left) || has(pair.right)) edits.push_back(pair_edit(kind, pair.left, pair.right, value));
    }
    return edits;
}

}  // namespace

Result<std::vector<ControlEdit>, std::string> parse_control(std::string_view line, ShapeNames names) {
    const std::size_t equals = line.rfind('=');
    const std::size_t dot = line.substr(0, equals).rfind('.');
    if (equals == std::string_view::npos || dot == std::string_view::npos)
        return refuse(line, "must read WHO.CONTROL=VALUE, like brows.sparsity=2");
    const std::string_view who = line.substr(0, dot);
    const std::string_view what = line.substr(dot + 1, equals - dot - 1);
    std::string_view value = line.substr(equals + 1);
    const auto* const word =
        std::find_if(kWords.begin(), kWords.end(), [&](const Word& each) { return each.text == what; });
    if (word == kWords.end()) {
        return refuse(line, "there is no control '" + std::string(what) +
                                "'; there are sparsity, ridge, temporal, multiplier, offset, range, symmetry "
                                "and cancel");
    }
    ControlEdit edit;
    edit.kind = word->kind;
    const std::size_t comma = value.find(',');
    if (edit.kind == ControlKind::kRange) {
        const auto high = comma == std::string_view::npos ? std::nullopt : number(value.substr(comma + 1));
        if (!high) return refuse(line, "a range has two ends: LOW,HIGH");
        edit.high = *high;
        value = value.substr(0, comma);
    }
    const auto low = number(value);
    if (!low) return refuse(line, "'" + std::string(value) + "' is no number");
    edit.value = *low;
    std::vector<ControlEdit> edits;
    if (is_pair(edit.kind)) {
        auto pairs = pair_edits(edit.kind, who, edit.value, names);
        if (!pairs) return refuse(line, pairs.error());
        edits = std::move(*pairs);
    } else {
        const auto selected = select_shapes(who, names);
        if (!selected) return refuse(line, selected.error());
        for (const std::size_t i : *selected) put_in(edit.shapes, i);
        if (!selected->empty()) edits.push_back(edit);
    }
    if (!std::all_of(edits.begin(), edits.end(), [](const ControlEdit& each) { return is_valid(each); }) ||
        (edits.empty() && !is_pair(edit.kind) && !is_valid(edit)))
        return refuse(line, "the value is outside its limits, see headrig control --help");
    return edits;
}

Result<std::vector<ControlEdit>, std::string> parse_controls(std::span<const std::string> lines,
                                                             ShapeNames names) {
    std::vector<ControlEdit> all;
    for (const std::string& line : lines) {
        const auto edits = parse_control(line, names);
        if (!edits) return failure(edits.error());
        all.insert(all.end(), edits->begin(), edits->end());
    }
    return all;
}

}  // namespace rig
