// An artist's controls as a person writes them, one wish a line, and what they mean for the shapes of a pack:
//
//   WHO.sparsity=2         factor on the L1 term: 0..10000, 1 neutral; likewise ridge (L2) and temporal
//   WHO.multiplier=1.2     of the solved weight, 1 neutral
//   WHO.offset=0.05        added behind the multiplier, 0 neutral
//   WHO.range=0,0.8        low and high end, inside the pack's own
//   WHO.symmetry=10        each shape of WHO on the left with its partner on the right; 0 unties
//   A,B.symmetry=10        these two
//   A,B.cancel=1           these two must not be on together; 0 allows it again
//
// WHO is a region or a shape's name (shape_selection.hpp). Later lines replace what earlier ones said.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/control_edit.hpp"
#include "core/base/result.hpp"
#include "firmware_host/settings/shape_selection.hpp"

namespace rig {

// The edits of one line, each of them valid for these shapes; none when a region has no shape in this rig. Or
// a sentence that says what is wrong with the line.
[[nodiscard]] Result<std::vector<ControlEdit>, std::string> parse_control(std::string_view line,
                                                                          ShapeNames names);

// The edits of all lines in their order, or what is wrong with the first that is.
[[nodiscard]] Result<std::vector<ControlEdit>, std::string> parse_controls(std::span<const std::string> lines,
                                                                           ShapeNames names);

}  // namespace rig
