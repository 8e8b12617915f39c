// Which shapes of a rig a person means: regions of the face by name, or one shape by its own.
//
// A region is a pattern on shape names, letters of either case:
//   brows   brow                     mouth   mouth, lip, tongue
//   lids    eye, lid, blink          jaw     jaw, chin
//   cheeks  cheek                    left    ends in _L .L -L or Left; starts with L_ or left_
//   nose    nose, sneer, nostril     right   the same with R and Right
//   all     every shape
// A shape may be in several. jawLeft, mouthLeft and tongueLeft, and those to the right, move the whole to one
// side: they are on no side.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"

namespace rig {

using ShapeNames = std::span<const std::string_view>;

inline constexpr std::string_view kRegionList = "brows, lids, cheeks, nose, mouth, jaw, left, right, all";

// Rising indices. A region that this rig has no shape of is empty; a word that is neither a region nor a name
// of `names` is refused with a sentence.
[[nodiscard]] Result<std::vector<std::size_t>, std::string> select_shapes(std::string_view selector,
                                                                          ShapeNames names);

struct SidePair {
    std::size_t left = 0;
    std::size_t right = 0;
    bool operator==(const SidePair&) const = default;
};
// Shapes that are on the left, each with the shape of the same name on the right, in the order of the left.
[[nodiscard]] std::vector<SidePair> side_pairs(ShapeNames names);

}  // namespace rig
