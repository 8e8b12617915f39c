// Which filter smooths which shape, as a person writes it: options of a command line, or a [smoothing] table
// of a board file or settings file (filter_table.hpp):
//
//   [smoothing]
//   filter = "savitzky-golay"      # none, one-euro (the default) or savitzky-golay
//   window = 15                    # frames, 3 to 61, of savitzky-golay
//   delay = 7                      # frames, below the window; half the window when it is left out
//   [smoothing.shapes]             # exceptions; regions and shape names, the last that matches wins
//   lids = "one-euro"
//   jawOpen = "savitzky-golay:9"   # with a window of its own; the delay is of the whole face
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/result.hpp"
#include "core/filter/smoothing.hpp"
#include "firmware_host/settings/shape_selection.hpp"

namespace rig {

struct FilterSettings {
    std::optional<FilterKind> kind;  // one-euro when nobody says
    std::optional<int> window_frames;
    std::optional<int> delay_frames;
    std::vector<std::pair<std::string, std::string>> shapes;  // selector, filter
};

// "none", "one-euro", "savitzky-golay"; nothing for another word.
[[nodiscard]] std::optional<FilterKind> filter_kind(std::string_view word);

// `over`, where it says something, replaces `under`.
[[nodiscard]] FilterSettings merged(const FilterSettings& under, const FilterSettings& over);

// Nothing at all is to be smoothed: then nothing is blended after a loss either.
[[nodiscard]] bool smooths_nothing(const FilterSettings& settings);

// The choice for the shapes of a pack, checked, or a sentence that says what is wrong.
[[nodiscard]] Result<FilterChoice, std::string> filter_choice(const FilterSettings& settings,
                                                              ShapeNames names);

}  // namespace rig
