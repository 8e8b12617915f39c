#include "core/detect/components.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/support/random.hpp"

namespace {

using namespace rig;
using test::SeededRandom;

struct Tables {
    std::vector<ComponentLabel> labels = std::vector<ComponentLabel>(4096);
    std::vector<std::uint16_t> label_of = std::vector<std::uint16_t>(4096);
    std::vector<Run> grouped = std::vector<Run>(4096);
    std::vector<Component> components = std::vector<Component>(512);
    ComponentStorage storage() { return {labels, label_of, grouped, components}; }
};

std::vector<Run> runs_of(const std::vector<std::string>& rows) {
    std::vector<Run> runs;
    for (std::size_t y = 0; y < rows.size(); ++y) {
        for (std::size_t x = 0; x < rows[y].size(); ++x) {
            if (rows[y][x] != '#') continue;
            const std::size_t begin = x;
            while (x < rows[y].size() && rows[y][x] == '#') ++x;
            runs.push_back({static_cast<std::uint16_t>(y), static_cast<std::uint16_t>(begin),
                            static_cast<std::uint16_t>(x)});
        }
    }
    return runs;
}

TEST(Components, NothingGivesNothing) {
    Tables tables;
    EXPECT_EQ(connect({}, {1}, tables.storage()).components, 0U);
}

TEST(Components, AUAndItsInsideAreTwo) {
    Tables tables;
    const auto counts = connect(runs_of({"#...#", "#.#.#", "#...#", "#####"}), {1}, tables.storage());
    ASSERT_EQ(counts.components, 2U);
    const Component& u = tables.components[0];
    EXPECT_EQ(u.area_px, 11U);
    EXPECT_EQ(u.count, 7U);
    EXPECT_EQ(u.left, 0);
    EXPECT_EQ(u.right, 4);
    EXPECT_EQ(u.top, 0);
    EXPECT_EQ(u.bottom, 3);
    EXPECT_EQ(tables.components[1].area_px, 1U);
}

TEST(Components, DiagonalNeighboursTouch) {
    Tables tables;
    EXPECT_EQ(connect(runs_of({"#..", ".#.", "..#"}), {1}, tables.storage()).components, 1U);
    EXPECT_EQ(connect(runs_of({"#...", "...#"}), {1}, tables.storage()).components, 2U);
    EXPECT_EQ(connect(runs_of({"#", ".", "#"}), {1}, tables.storage()).components, 2U);
}

TEST(Components, SmallOnesAreCountedAndLeaveNoTrace) {
    Tables tables;
    const auto counts = connect(runs_of({"#.##.#", "..##..", "......", "####.."}), {4}, tables.storage());
    EXPECT_EQ(counts.components, 2U);
    EXPECT_EQ(counts.small, 2U);
    EXPECT_EQ(tables.components[0].first, 0U);
    EXPECT_EQ(tables.components[1].first, 2U);
    EXPECT_EQ(tables.grouped[2].y, 3);
}

TEST(Components, AFullTableIsCounted) {
    Tables tables;
    tables.components.resize(2);
    const auto counts = connect(runs_of({"#.#.#.#"}), {1}, tables.storage());
    EXPECT_EQ(counts.components, 2U);
    EXPECT_EQ(counts.dropped, 2U);
}

// Labels by repeated sweeps over a pixel grid.
std::vector<int> plain_labels(const std::vector<std::string>& rows) {
    const int height = static_cast<int>(rows.size());
    const int width = static_cast<int>(rows[0].size());
    std::vector<int> labels(static_cast<std::size_t>(width * height), -1);
    const auto inside = [&](int x, int y) {
        return x >= 0 && y >= 0 && x < width && y < height &&
               rows[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)] == '#';
    };
    for (int i = 0; i < width * height; ++i) {
        if (inside(i % width, i / width)) labels[static_cast<std::size_t>(i)] = i;
    }
    for (bool changed = true; changed;) {
        changed = false;
        for (int i = 0; i < width * height; ++i) {
            for (int d = 0; d < 9 && labels[static_cast<std::size_t>(i)] >= 0; ++d) {
                const int x = i % width + d % 3 - 1;
                const int y = i / width + d / 3 - 1;
                if (!inside(x, y)) continue;
                const int other = labels[static_cast<std::size_t>(y * width + x)];
                if (other < labels[static_cast<std::size_t>(i)]) {
                    labels[static_cast<std::size_t>(i)] = other;
                    changed = true;
                }
            }
        }
    }
    return labels;
}

TEST(Components, RandomPicturesEqualThePlainLabelling) {
    SeededRandom random(7);
    Tables tables;
    for (int round = 0; round < 300; ++round) {
        const std::size_t width = 1 + random.below(40);
        const std::size_t height = 1 + random.below(40);
        const double density = random.uniform(0.05, 0.7);
        std::vector<std::string> rows(height, std::string(width, '.'));
        for (std::string& row : rows) {
            for (char& c : row) c = random.chance(density) ? '#' : '.';
        }
        const std::vector<int> labels = plain_labels(rows);
        const auto counts = connect(runs_of(rows), {1}, tables.storage());
        std::vector<int> distinct;
        for (const int label : labels) {
            if (label >= 0) distinct.push_back(label);
        }
        std::sort(distinct.begin(), distinct.end());
        distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
        ASSERT_EQ(counts.components, distinct.size());
        for (std::size_t c = 0; c < counts.components; ++c) {
            const Component& component = tables.components[c];
            std::uint32_t area = 0;
            for (std::uint32_t r = component.first; r < component.first + component.count; ++r) {
                for (std::size_t x = tables.grouped[r].begin; x < tables.grouped[r].end; ++x, ++area) {
                    ASSERT_EQ(labels[tables.grouped[r].y * width + x], distinct[c]);
                }
            }
            ASSERT_EQ(area, component.area_px);
            ASSERT_EQ(area,
                      static_cast<std::uint32_t>(std::count(labels.begin(), labels.end(), distinct[c])));
        }
    }
}

}  // namespace
