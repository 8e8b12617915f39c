// The region sections of a pack: from their bytes to RegionModels, or the rule that they break. Part of
// open_pack(), which reads the tensors and has checked that their numbers are finite and of a plausible size.
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

// The sections as they lie in the file, all regions one after the other.
struct RegionSections {
    std::array<std::string_view, kMaxRegions> names{};
    std::span<const std::uint16_t> markers;
    std::span<const float> marker_blend;
    std::span<const float> origin_mm;
    std::span<const float> examples_mm;
    std::span<const float> shapes;
    std::span<const float> shape_blend;
};

// Reads solver and counts of each region and adds them up in `counts`. `table` is any bytes; counts.regions
// is within kMaxRegions. kSectionLength, kRegionTable.
[[nodiscard]] Result<void, PackError> read_region_table(ByteSpan table, SolverKind solver, PackCounts& counts,
                                                        SolvePack& pack);

// `count` indices; kSectionLength.
[[nodiscard]] Result<std::span<const std::uint16_t>, PackError> read_marker_list(ByteSpan part,
                                                                                 std::size_t count);

// Hands every region its part and checks what belongs together: markers rising and inside the pack, blends
// that sum to 1, origins as the solvers need them, zero padding. Lengths fit the counts already.
[[nodiscard]] Result<void, PackError> assemble_regions(const RegionSections& sections, SolvePack& pack);

}  // namespace rig
