#include "core/track/assignment.hpp"

#include <limits>

#include "core/base/check.hpp"

namespace rig {

namespace {

constexpr double kInfinite = std::numeric_limits<double>::max();

// Rows and columns count from 1; 0 is the start of every path. Column column_count + r is row r's own "alone"
// column.
double entry(const AssignmentProblem& p, std::size_t row, std::size_t column) {
    if (column > p.column_count) return column - p.column_count == row ? p.alone_cost : kInfinite;
    const double cost = p.cost[(row - 1) * p.column_count + (column - 1)];
    return cost < p.alone_cost ? cost : kInfinite;
}

// Grows the tree of shortest paths from the row in column 0 until it meets a column without a row.
std::size_t grow_path(const AssignmentProblem& p, std::size_t columns, AssignmentWorkspace& w) {
    std::size_t at = 0;
    do {
        w.done[at] = true;
        const std::size_t row = w.row_of[at];
        double nearest = kInfinite;
        std::size_t next = 0;
        for (std::size_t c = 1; c <= columns; ++c) {
            if (w.done[c]) continue;
            const double cost = entry(p, row, c);
            if (cost < kInfinite) {
                const double reduced = cost - w.row_potential[row] - w.column_potential[c];
                if (reduced < w.reached[c]) {
                    w.reached[c] = reduced;
                    w.came_from[c] = static_cast<std::uint16_t>(at);
                }
            }
            if (w.reached[c] < nearest) {
                nearest = w.reached[c];
                next = c;
            }
        }
        RIG_CHECK(next != 0);  // a row's own column is always within reach
        for (std::size_t c = 0; c <= columns; ++c) {
            if (w.done[c]) {
                w.row_potential[w.row_of[c]] += nearest;
                w.column_potential[c] -= nearest;
            } else if (w.reached[c] < kInfinite) {
                w.reached[c] -= nearest;
            }
        }
        at = next;
    } while (w.row_of[at] != 0);
    return at;
}

}  // namespace

void solve_assignment(const AssignmentProblem& problem, AssignmentWorkspace& w,
                      std::span<std::int16_t> column_of) {
    const std::size_t rows = problem.row_count;
    const std::size_t columns = problem.column_count + rows;
    RIG_CHECK(rows <= kMaxAssignmentRows && problem.column_count <= kMaxAssignmentColumns);
    RIG_CHECK(problem.cost.size() >= rows * problem.column_count && column_of.size() >= rows);
    for (std::size_t r = 0; r <= rows; ++r) w.row_potential[r] = 0.0;
    for (std::size_t c = 0; c <= columns; ++c) {
        w.column_potential[c] = 0.0;
        w.row_of[c] = 0;
    }
    for (std::size_t row = 1; row <= rows; ++row) {
        w.row_of[0] = static_cast<std::uint16_t>(row);
        for (std::size_t c = 0; c <= columns; ++c) {
            w.reached[c] = kInfinite;
            w.done[c] = false;
        }
        std::size_t at = grow_path(problem, columns, w);
        while (at != 0) {
            const std::size_t before = w.came_from[at];
            w.row_of[at] = w.row_of[before];
            at = before;
        }
    }
    for (std::size_t r = 0; r < rows; ++r) column_of[r] = -1;
    for (std::size_t c = 1; c <= problem.column_count; ++c) {
        if (w.row_of[c] != 0) column_of[w.row_of[c] - 1U] = static_cast<std::int16_t>(c - 1);
    }
}

}  // namespace rig
