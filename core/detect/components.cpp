#include "core/detect/components.hpp"

#include <algorithm>

#include "core/base/check.hpp"

namespace rig {

namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFU;

std::uint32_t root_of(std::span<std::uint32_t> parents, std::uint32_t run) {
    while (parents[run] != run) {
        parents[run] = parents[parents[run]];
        run = parents[run];
    }
    return run;
}

// The smaller number becomes the root, so a component is named by its first run whatever the order of the
// unions.
void unite(std::span<std::uint32_t> parents, std::uint32_t a, std::uint32_t b) {
    const std::uint32_t root_a = root_of(parents, a);
    const std::uint32_t root_b = root_of(parents, b);
    if (root_a < root_b) {
        parents[root_b] = root_a;
    } else {
        parents[root_a] = root_b;
    }
}

void unite_rows(std::span<const Run> runs, std::span<std::uint32_t> parents) {
    std::uint32_t above = 0;      // first run of the row above that can still touch
    std::uint32_t row_begin = 0;  // of the current run's row
    for (std::uint32_t i = 0; i < runs.size(); ++i) {
        parents[i] = i;
        if (i > 0 && runs[i].y != runs[i - 1].y) {
            above = row_begin;
            row_begin = i;
        }
        if (row_begin == 0 || runs[above].y + 1 != runs[i].y) continue;
        while (above < row_begin && runs[above].end < runs[i].begin) ++above;  // equal touches diagonally
        for (std::uint32_t k = above; k < row_begin && runs[k].begin <= runs[i].end; ++k)
            unite(parents, k, i);
    }
}

void widen(Component& component, const Run& run) {
    component.left = std::min(component.left, run.begin);
    component.right = std::max(component.right, static_cast<std::uint16_t>(run.end - 1));
    component.bottom = run.y;
    ++component.count;
}

}  // namespace

ComponentCounts connect(std::span<const Run> runs, const ComponentLimits& limits,
                        const ComponentStorage& storage) {
    const std::size_t total = runs.size();
    RIG_CHECK(storage.parents.size() >= total && storage.areas.size() >= total &&
              storage.grouped.size() >= total);
    unite_rows(runs, storage.parents);
    std::fill_n(storage.areas.begin(), total, 0U);
    for (std::uint32_t i = 0; i < total; ++i) {
        const std::uint32_t root = root_of(storage.parents, i);
        storage.parents[i] = root;
        storage.areas[root] += static_cast<std::uint32_t>(runs[i].end - runs[i].begin);
    }

    // Roots come before their members, so one pass numbers the components; areas[] of a root turns into its
    // number.
    ComponentCounts counts;
    for (std::uint32_t i = 0; i < total; ++i) {
        const std::uint32_t root = storage.parents[i];
        if (root == i) {
            const std::uint32_t area = storage.areas[i];
            const bool small = area < limits.min_area_px;
            const bool full = !small && counts.components == storage.components.size();
            counts.small += small ? 1 : 0;
            counts.dropped += full ? 1 : 0;
            storage.areas[i] = kNone;
            if (!small && !full) {
                storage.areas[i] = static_cast<std::uint32_t>(counts.components);
                storage.components[counts.components++] = {0,         0, area,     runs[i].begin,
                                                           runs[i].y, 0, runs[i].y};
            }
        }
        const std::uint32_t number = storage.areas[root];
        if (number != kNone) widen(storage.components[number], runs[i]);
    }

    std::uint32_t next = 0;
    for (std::size_t c = 0; c < counts.components; ++c) {
        storage.components[c].first = next;
        next += storage.components[c].count;
        storage.components[c].count = 0;
    }
    for (std::uint32_t i = 0; i < total; ++i) {
        const std::uint32_t number = storage.areas[storage.parents[i]];
        if (number == kNone) continue;
        Component& component = storage.components[number];
        storage.grouped[component.first + component.count++] = runs[i];
    }
    return counts;
}

}  // namespace rig
