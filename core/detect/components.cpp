#include "core/detect/components.hpp"

#include <algorithm>

#include "core/base/check.hpp"

namespace rig {

namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFU;

std::uint16_t root_of(const ComponentLabel* labels, std::uint16_t label) {
    while (labels[label].parent != label) label = labels[label].parent;
    return label;
}

// The smaller label becomes the root, so a component is named by its first run whatever the order of the
// unions.
std::uint16_t unite(ComponentLabel* labels, std::uint16_t a, std::uint16_t b) {
    const std::uint16_t least = std::min(a, b);
    ComponentLabel& other = labels[std::max(a, b)];
    other.parent = least;
    labels[least].area_px += other.area_px;
    labels[least].count = static_cast<std::uint16_t>(labels[least].count + other.count);
    return least;
}

// Most runs touch one run of the row above and take its label; only a second one makes a union. Returns the
// number of labels.
std::uint32_t unite_rows(const Run* runs, std::uint32_t total, ComponentLabel* labels,
                         std::uint16_t* label_of) {
    std::uint32_t count = 0;
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
            std::uint16_t root = 0;
            if (above < above_end && runs[above].begin <= end) {
                root = root_of(labels, label_of[above]);
                for (std::uint32_t k = above + 1; k < above_end && runs[k].begin <= end; ++k) {
                    const std::uint16_t other = root_of(labels, label_of[k]);
                    if (other != root) root = unite(labels, root, other);
                }
            } else {
                root = static_cast<std::uint16_t>(count);
                labels[count++] = {0, root, 0};
            }
            labels[root].area_px += static_cast<std::uint32_t>(end - begin);
            ++labels[root].count;
            label_of[i] = root;
        }
        above = row;
        above_end = i;
    }
    return count;
}

// Of a new component, whose runs go to `next` and after; or kNone.
std::uint32_t number_of(const ComponentLabel& root, const ComponentLimits& limits,
                        std::span<Component> components, ComponentCounts& counts, std::uint32_t& next) {
    if (root.area_px < limits.min_area_px) {
        ++counts.small;
        return kNone;
    }
    if (counts.components == components.size()) {
        ++counts.dropped;
        return kNone;
    }
    components[counts.components] = {next, 0, root.area_px, 0xFFFF, 0, 0, 0};
    next += root.count;
    return static_cast<std::uint32_t>(counts.components++);
}

}  // namespace

ComponentCounts connect(std::span<const Run> runs, const ComponentLimits& limits,
                        const ComponentStorage& storage) {
    const std::size_t total = runs.size();
    RIG_CHECK(storage.labels.size() >= total && storage.label_of.size() >= total &&
              storage.grouped.size() >= total && total <= kMaxRuns);
    ComponentLabel* const labels = storage.labels.data();
    std::uint16_t* const label_of = storage.label_of.data();
    const std::uint32_t known = unite_rows(runs.data(), static_cast<std::uint32_t>(total), labels, label_of);

    // Roots come before what was joined to them, so one pass numbers the components.
    ComponentCounts counts;
    std::uint32_t next = 0;
    for (std::uint32_t i = 0; i < known; ++i) {
        ComponentLabel& label = labels[i];
        label.area_px = label.parent == i ? number_of(label, limits, storage.components, counts, next)
                                          : labels[label.parent].area_px;
    }

    for (std::size_t i = 0; i < total; ++i) {
        const std::uint32_t number = labels[label_of[i]].area_px;
        if (number == kNone) continue;
        Component& component = storage.components[number];
        if (component.count == 0) component.top = runs[i].y;
        storage.grouped[component.first + component.count] = runs[i];
        widen(component, runs[i]);
    }
    return counts;
}

}  // namespace rig
