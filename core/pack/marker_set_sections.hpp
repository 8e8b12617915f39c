// The marker set sections of a pack: from their bytes to MarkerSetModels, or the rule that they break. Part
// of open_pack(), which reads the tensors and has checked that their numbers are finite and of a plausible
// size.
#pragma once

#include <array>
#include <span>
#include <string_view>

#include "core/base/bytes.hpp"
#include "core/base/result.hpp"
#include "core/pack/pack_error.hpp"
#include "core/pack/pack_format.hpp"
#include "core/pack/solve_pack.hpp"

namespace rig {

// The sections as they lie in the file, all sets one after the other.
struct MarkerSetSections {
    std::array<std::string_view, kMaxMarkerSets> names{};
    std::span<const std::uint16_t> markers;
    std::span<const float> mean_mm;
    std::span<const float> modes;
    std::span<const float> variance_mm2;
    std::span<const float> residual_mm2;
};

// Reads level and counts of each set and adds them up in `counts`. `table` is any bytes. kMarkerSetTable.
[[nodiscard]] Result<void, PackError> read_marker_set_table(ByteSpan table, PackCounts& counts,
                                                            SolvePack& pack);

// Hands every set its part and checks what belongs together: markers rising and inside the pack, modes
// orthonormal, variances falling. Lengths fit the counts already.
[[nodiscard]] Result<void, PackError> assemble_marker_sets(const MarkerSetSections& sections,
                                                           SolvePack& pack);

}  // namespace rig
