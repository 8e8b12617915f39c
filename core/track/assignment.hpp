// Which row goes with which column, each at most once, at the least total cost; a row may stay alone at a
// price. Exact (shortest augmenting paths with potentials, the Hungarian method's O(rows^2 columns) form).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/limits.hpp"

namespace rig {

inline constexpr std::size_t kMaxAssignmentRows = kMaxMarkers;
inline constexpr std::size_t kMaxAssignmentColumns = kMaxPoints;

// cost[row * column_count + column] >= 0; an entry at or above alone_cost is never chosen.
struct AssignmentProblem {
    std::size_t row_count = 0;
    std::size_t column_count = 0;
    std::span<const double> cost;
    double alone_cost = 0.0;
};

struct AssignmentWorkspace {
    static constexpr std::size_t kColumns = kMaxAssignmentColumns + kMaxAssignmentRows + 1;
    std::array<double, kMaxAssignmentRows + 1> row_potential{};
    std::array<double, kColumns> column_potential{};
    std::array<double, kColumns> reached{};
    std::array<std::uint16_t, kColumns> row_of{};
    std::array<std::uint16_t, kColumns> came_from{};
    std::array<bool, kColumns> done{};
};

// column_of[row] = the chosen column, or -1.
void solve_assignment(const AssignmentProblem& problem, AssignmentWorkspace& workspace,
                      std::span<std::int16_t> column_of);

}  // namespace rig
