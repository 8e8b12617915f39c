// Connected components of runs: union-find of fixed capacity, eight-connected. Not for: pixels or shapes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/detect/bit_rows.hpp"
#include "core/image/kernels.hpp"

namespace rig {

// Runs [first, first + count) of `grouped` in raster order; bounds are inclusive.
struct Component {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
    std::uint32_t area_px = 0;
    std::uint16_t left = 0;
    std::uint16_t top = 0;
    std::uint16_t right = 0;
    std::uint16_t bottom = 0;
};

[[nodiscard]] inline std::span<const Run> members_of(const Component& component,
                                                     std::span<const Run> grouped) {
    return grouped.subspan(component.first, component.count);
}

// Of its box, px.
[[nodiscard]] inline int length_of(const Component& component) {
    return std::max(component.right - component.left, component.bottom - component.top) + 1;
}

// Whether the middle of its box is part of it.
[[nodiscard]] inline bool holds_its_middle(const Component& component, std::span<const Run> runs) {
    const int x = (component.left + component.right + 1) / 2;
    const int y = (component.top + component.bottom + 1) / 2;
    return std::any_of(runs.begin(), runs.end(),
                       [&](const Run& run) { return run.y == y && run.begin <= x && x < run.end; });
}

// Bounds and count of a component with one more run; runs come in raster order.
inline void widen(Component& component, const Run& run) {
    component.left = std::min(component.left, run.begin);
    component.right = std::max(component.right, static_cast<std::uint16_t>(run.end - 1));
    component.bottom = run.y;
    ++component.count;
}

struct ComponentLimits {
    std::uint32_t min_area_px = 1;
};

// Runs that are known to hang together while rows are still being joined.
struct ComponentLabel {
    std::uint32_t area_px = 0;  // then the number of its component
    std::uint16_t parent = 0;   // a label that it was joined to, or itself
    std::uint16_t count = 0;    // of runs
};
static_assert(kMaxRuns <= 65536);

// Storage that connect() borrows: labels, label_of and grouped are as long as the longest input, which has at
// most kMaxRuns.
struct ComponentStorage {
    std::span<ComponentLabel> labels;
    std::span<std::uint16_t> label_of;  // by run
    std::span<Run> grouped;
    std::span<Component> components;
};

struct ComponentCounts {
    std::size_t components = 0;
    std::size_t small = 0;    // left out: area below the least
    std::size_t dropped = 0;  // left out: no room
};

// Groups `runs` (raster order, not overlapping) into components, numbered by their first run. Components
// below the least area are counted and left out, so that noise cannot fill the table.
ComponentCounts connect(std::span<const Run> runs, const ComponentLimits& limits,
                        const ComponentStorage& storage);

// A set of bits, a window's whose corner is (left, top), as a component in pixels of the image; its runs go
// to `runs`. False: no room.
[[nodiscard]] bool component_of(const BitRows& rows, int height, int left, int top, std::span<Run> runs,
                                Component& component);

}  // namespace rig
