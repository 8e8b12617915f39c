// One thing that an artist sets, as it travels: from a host over the wire, or from a settings file, to the
// solver. What it does to a solve is in core/solve/controls.hpp.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/limits.hpp"

namespace rig {

enum class ControlKind : std::uint8_t {
    // of shapes
    kSparsity = 0,    // value: factor on the L1 term, 0..kMaxControlFactor, 1 neutral
    kRidge = 1,       // value: factor on the L2 term, likewise
    kTemporal = 2,    // value: factor on the pull towards the previous solution, likewise
    kMultiplier = 3,  // value: of the solved weight, +-kMaxControlFactor, 1 neutral
    kOffset = 4,      // value: added behind the multiplier, +-kMaxControlWeight, 0 neutral
    kRange = 5,       // value..high, both +-kMaxControlWeight; as far as the pack's own range allows
    // of pairs
    kSymmetry =
        16,        // value: strength of the pull of two shapes to each other, 0..kMaxControlFactor; 0: untie
    kCancel = 17,  // value: 1 the two must not be on together, 0 they may again
};

inline constexpr float kMaxControlFactor = 1e4F;
inline constexpr float kMaxControlWeight = 1e3F;  // as far as a pack's ranges may reach

using ShapeMask = std::array<std::uint8_t, kMaxShapes / 8>;  // shape i: bit i % 8 of byte i / 8

[[nodiscard]] constexpr bool is_in(const ShapeMask& mask, std::size_t shape) {
    return (mask[shape / 8] >> (shape % 8) & 1U) != 0;
}
constexpr void put_in(ShapeMask& mask, std::size_t shape) {
    mask[shape / 8] = static_cast<std::uint8_t>(mask[shape / 8] | 1U << (shape % 8));
}

struct ControlEdit {
    ControlKind kind = ControlKind::kSparsity;
    float value = 1.0F;
    float high = 0.0F;        // of kRange alone, not below value; 0 otherwise
    std::uint16_t first = 0;  // of pairs alone, different from second; 0 otherwise
    std::uint16_t second = 0;
    ShapeMask shapes{};  // of shapes alone; 0 for pairs
    bool operator==(const ControlEdit&) const = default;
};

[[nodiscard]] constexpr bool is_pair(ControlKind kind) {
    return kind >= ControlKind::kSymmetry;
}

// All that can be said without knowing the pack. Any bytes are safe.
[[nodiscard]] constexpr bool is_valid(const ControlEdit& edit) {
    const auto within = [](float x, float low, float high) { return x >= low && x <= high; };  // NaN: no
    const bool no_high = edit.high == 0.0F;
    switch (edit.kind) {
        case ControlKind::kSparsity:
        case ControlKind::kRidge:
        case ControlKind::kTemporal:
            return no_high && edit.first == 0 && edit.second == 0 &&
                   within(edit.value, 0.0F, kMaxControlFactor);
        case ControlKind::kMultiplier:
            return no_high && edit.first == 0 && edit.second == 0 &&
                   within(edit.value, -kMaxControlFactor, kMaxControlFactor);
        case ControlKind::kOffset:
            return no_high && edit.first == 0 && edit.second == 0 &&
                   within(edit.value, -kMaxControlWeight, kMaxControlWeight);
        case ControlKind::kRange:
            return edit.first == 0 && edit.second == 0 && edit.value >= -kMaxControlWeight &&
                   edit.value <= edit.high && edit.high <= kMaxControlWeight;
        case ControlKind::kSymmetry:
            return no_high && edit.shapes == ShapeMask{} && edit.first < kMaxShapes &&
                   edit.second < kMaxShapes && edit.first != edit.second &&
                   within(edit.value, 0.0F, kMaxControlFactor);
        case ControlKind::kCancel:
            return no_high && edit.shapes == ShapeMask{} && edit.first < kMaxShapes &&
                   edit.second < kMaxShapes && edit.first != edit.second &&
                   (edit.value == 0.0F || edit.value == 1.0F);
    }
    return false;
}

}  // namespace rig
