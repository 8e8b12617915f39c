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
std::uint32_t unite_rows(const Run* __restrict runs, std::uint32_t total, ComponentLabel* __restrict labels,
                         std::uint16_t* __restrict label_of) {
    std::uint32_t count = 0;
    std::uint32_t above = 0;  // runs of the row above that can still touch: from here
    std::uint32_t row = 0;    // to here, where the row of the run begins
    int y = -2;
    for (std::uint32_t i = 0; i < total; ++i) {
        const Run run = runs[i];
        if (run.y != y) {
            above = y + 1 == run.y ? row : i;
            row = i;
            y = run.y;
        }
        while (above < row && runs[above].end < run.begin) ++above;  // equal touches diagonally
        std::uint16_t root = static_cast<std::uint16_t>(count);
        if (above < row && runs[above].begin <= run.end) {
            root = root_of(labels, label_of[above]);
            for (std::uint32_t k = above + 1; k < row && runs[k].begin <= run.end; ++k) {
                const std::uint16_t other = root_of(labels, label_of[k]);
                if (other != root) root = unite(labels, root, other);
            }
        } else {
            labels[count++] = {0, root, 0};
        }
        labels[root].area_px += static_cast<std::uint32_t>(run.end - run.begin);
        ++labels[root].count;
        label_of[i] = root;
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

// Sets the bounds of a component whose runs are in their places.
void bound(const Run* grouped, Component& component) {
    const Run* const runs = grouped + component.first;
    std::uint32_t left = runs[0].begin;
    std::uint32_t end = runs[0].end;
    for (std::uint32_t i = 1; i < component.count; ++i) {
        left = std::min<std::uint32_t>(left, runs[i].begin);
        end = std::max<std::uint32_t>(end, runs[i].end);
    }
    component.left = static_cast<std::uint16_t>(left);
    component.right = static_cast<std::uint16_t>(end - 1);
    component.top = runs[0].y;
    component.bottom = runs[component.count - 1].y;
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

    Run* const grouped = storage.grouped.data();
    Component* const components = storage.components.data();
    for (std::size_t i = 0; i < total; ++i) {
        const std::uint32_t number = labels[label_of[i]].area_px;
        if (number == kNone) continue;
        Component& component = components[number];
        grouped[component.first + component.count++] = runs[i];
    }
    for (std::size_t i = 0; i < counts.components; ++i) bound(grouped, components[i]);
    return counts;
}

bool component_of(const BitRows& rows, int height, int left, int top, std::span<Run> runs,
                  Component& component) {
    component = Component{};
    component.left = 0xFFFF;
    for (int y = 0; y < height; ++y) {
        for (std::uint64_t rest = rows[static_cast<std::size_t>(y)]; rest != 0;) {
            const int begin = std::countr_zero(rest);
            const int end = begin + std::countr_one(rest >> begin);
            rest = end < 64 ? rest & ~row_mask(end) : 0;
            if (component.count == runs.size()) return false;
            const Run run{static_cast<std::uint16_t>(top + y), static_cast<std::uint16_t>(left + begin),
                          static_cast<std::uint16_t>(left + end)};
            if (component.count == 0) component.top = run.y;
            runs[component.count] = run;
            component.area_px += static_cast<std::uint32_t>(end - begin);
            widen(component, run);
        }
    }
    return true;
}

}  // namespace rig
