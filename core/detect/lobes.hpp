// A marker at the border of something larger and of its own side of the skin: retro-reflective paint at a
// highlight, ink at a shadow line. What is too wide or too long for a marker is taken away; what sticks out
// of it may be one. Not for: what lies wholly inside.
#pragma once

#include <cstddef>

#include "core/base/bounded_vector.hpp"
#include "core/detect/bit_rows.hpp"

namespace rig {

inline constexpr std::size_t kMaxLobes = 8;  // of one window
using Lobes = BoundedVector<BitRows, kMaxLobes>;

// Where a run of a component ends at something like a marker's rim.
struct RunEnd {
    int x = 0;
    int y = 0;
};
inline constexpr std::size_t kMaxRunEnds = 256;  // of a component
using RunEnds = BoundedVector<RunEnd, kMaxRunEnds>;

// Parts of `area` (width x height pixels of a window) that could be of a marker `size_px` long and hold one
// of `marks`: neither wider nor longer than one, none that reaches the window's border. What is beyond the
// window counts as area.
void find_lobes(const BitRows& area, const BitRows& marks, int width, int height, double size_px,
                Lobes& lobes);

}  // namespace rig
