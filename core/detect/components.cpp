#include "core/detect/components.hpp"

#include <algorithm>

#include "core/base/check.hpp"

namespace rig {

namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFU;

std::uint32_t root_of(const std::uint32_t* parents, std::uint32_t run) {
    while (parents[run] != run) run = parents[run];
    return run;
}

// The smaller number becomes the root, so a component is named by its first run whatever the order of the
// unions.
std::uint32_t unite(std::uint32_t* parents, std::uint32_t a, std::uint32_t b) {
    const std::uint32_t least = a < b ? a : b;
    parents[a < b ? b : a] = least;
    return least;
}

// Most runs touch one run of the row above and take its root; only a second one makes a union.
void unite_rows(const Run* runs, std::uint32_t total, std::uint32_t* parents) {
    std::uint32_t above = 0;  // runs of the row above that can still touch: from here
    std::uint32_t above_end = 0;
    std::uint32_t i = 0;
    while (i < total) {
        const std::uint32_t row = i;
        const std::uint16_t y = runs[i].y;
        if (above < above_end && runs[above].y + 1 != y) above = above_end;
        for (; i < total && runs[i].y == y; ++i) {
            const std::uint16_t begin = runs[i].begin;
            const std::uint16_t end = runs[i].end;
            while (above < above_end && runs[above].end < begin) ++above;  // equal touches diagonally
            std::uint32_t root = i;
            for (std::uint32_t k = above; k < above_end && runs[k].begin <= end; ++k) {
                const std::uint32_t other = root_of(parents, parents[k]);
                if (root == i) {
                    root = other;
                } else if (other != root) {
                    root = unite(parents, root, other);
                }
            }
            parents[i] = root;
        }
        above = row;
        above_end = i;
    }
}

// A new component's, or kNone.
std::uint32_t number_of(const Run& first, std::uint32_t area_px, const ComponentLimits& limits,
                        std::span<Component> components, ComponentCounts& counts) {
    if (area_px < limits.min_area_px) {
        ++counts.small;
        return kNone;
    }
    if (counts.components == components.size()) {
        ++counts.dropped;
        return kNone;
    }
    components[counts.components] = {0, 0, area_px, first.begin, first.y, 0, first.y};
    return static_cast<std::uint32_t>(counts.components++);
}

}  // namespace

ComponentCounts connect(std::span<const Run> runs, const ComponentLimits& limits,
                        const ComponentStorage& storage) {
    const std::size_t total = runs.size();
    RIG_CHECK(storage.parents.size() >= total && storage.areas.size() >= total &&
              storage.grouped.size() >= total);
    std::uint32_t* const parents = storage.parents.data();
    std::uint32_t* const areas = storage.areas.data();
    unite_rows(runs.data(), static_cast<std::uint32_t>(total), parents);
    for (std::uint32_t i = 0; i < total; ++i) {
        const std::uint32_t root = parents[parents[i]];  // parents come first, so the parent's is a root
        parents[i] = root;
        const auto length = static_cast<std::uint32_t>(runs[i].end - runs[i].begin);
        areas[i] = root == i ? length : 0;
        if (root != i) areas[root] += length;
    }

    // Roots come before their members, so one pass numbers the components; areas[] of a root turns into its
    // number.
    ComponentCounts counts;
    for (std::uint32_t i = 0; i < total; ++i) {
        const std::uint32_t root = parents[i];
        if (root == i) areas[i] = number_of(runs[i], areas[i], limits, storage.components, counts);
        const std::uint32_t number = areas[root];
        parents[i] = number;
        if (number != kNone) widen(storage.components[number], runs[i]);
    }

    std::uint32_t next = 0;
    for (std::size_t c = 0; c < counts.components; ++c) {
        storage.components[c].first = next;
        next += storage.components[c].count;
        storage.components[c].count = 0;
    }
    for (std::uint32_t i = 0; i < total; ++i) {
        const std::uint32_t number = parents[i];
        if (number == kNone) continue;
        Component& component = storage.components[number];
        storage.grouped[component.first + component.count++] = runs[i];
    }
    return counts;
}

}  // namespace rig
