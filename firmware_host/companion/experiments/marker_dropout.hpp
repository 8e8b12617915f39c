// Which markers are hidden in which frames, and the plain ways to fill the gaps: what inference is measured
// against.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/linalg.hpp"
#include "firmware_host/companion/rig_folder/rig_folder.hpp"

namespace rig::host {

struct DropoutMask {
    std::size_t frame_count = 0;
    std::size_t marker_count = 0;
    std::vector<char> hidden;  // [frames x markers]

    [[nodiscard]] bool at(std::size_t frame, std::size_t marker) const {
        return hidden[frame * marker_count + marker] != 0;
    }
    [[nodiscard]] double share() const;
};

// Bursts of 4 to 30 frames, a third of which hide three to six neighbours, until `share` of all entries is
// hidden; every marker is seen in the first frame. share 0..0.9. Deterministic.
[[nodiscard]] DropoutMask burst_dropout(const MarkerLayout& layout, std::size_t frame_count, double share,
                                        std::uint64_t seed);

// These markers are hidden for 30 frames of every 60, the others never.
[[nodiscard]] DropoutMask set_dropout(std::span<const std::uint16_t> markers, std::size_t frame_count,
                                      std::size_t marker_count);

// All but `seen` markers are hidden from frame 1 on, others every 30 frames.
[[nodiscard]] DropoutMask near_total_dropout(std::size_t seen, std::size_t frame_count,
                                             std::size_t marker_count, std::uint64_t seed);

// positions_mm [frames x markers]: what was measured; entries that the mask hides are not read. Return them
// with every gap filled: by the last position seen, or by a straight line to the next one (which a device
// does not know yet; the last one where none follows).
[[nodiscard]] std::vector<Vec3> held_last(std::span<const Vec3> positions_mm, const DropoutMask& mask);
[[nodiscard]] std::vector<Vec3> interpolated(std::span<const Vec3> positions_mm, const DropoutMask& mask);

}  // namespace rig::host
