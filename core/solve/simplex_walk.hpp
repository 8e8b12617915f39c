// The same problem as simplex_qp.hpp where float's inverse does not carry: examples that depend on each
// other, or nearly. A primal active set in double that changes its set by one example at a time and factors
// it anew each time: slower by far, and certain.
//
//   minimise 1/2 c^T (A + tilt I) c - b^T c   subject to   sum c = 1, c >= 0
//
//   A = G^T V G, b = G^T V g, summed in double from the same floats
//   tilt = 1e-10 of A's mean diagonal: dependent examples have a factor too, at an objective above the
//   optimum
//          by no more than half the tilt
//
// Every iterate is feasible and no worse than the one before.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/limits.hpp"

namespace rig {

struct SimplexWalkProblem {
    std::size_t rows = 0;
    std::size_t count = 0;            // n
    std::size_t stride = 0;           // of the examples
    std::span<const float> examples;  // G [R x stride]
    std::span<const float> target;    // g [R], finite
    std::span<const float>
        row_weight;  // diagonal of V [R]; empty: all 1. Where it is 0 the target is not read
};

struct SimplexWalkState {
    bool has_gram = false;  // for the examples and weights at hand; the caller clears it when they change
    std::array<double, kMaxRegionShapes * kMaxRegionShapes> gram{};  // A, rows kMaxRegionShapes apart
};

struct SimplexWalkWorkspace {
    std::array<double, kMaxRegionShapes * kMaxRegionShapes> factor{};
    std::array<double, kMaxRegionShapes> linear{};
    std::array<double, kMaxRegionShapes> c{};
    std::array<double, kMaxRegionShapes> pull{};
    std::array<double, kMaxRegionShapes> aim{};
    std::array<double, kMaxRegionShapes> ones{};
    std::array<std::uint16_t, kMaxRegionShapes> used{};
};

struct SimplexWalkReport {
    std::uint16_t iterations = 0;
    std::uint16_t changes = 0;
    double kkt = 0.0;  // as in SimplexQpReport
    double gap = 0.0;
    double objective = 0.0;
    bool optimal = false;
};

// On entry c [n] is a start, >= 0 and summing to 1, and `used` holds one bit an example in use: those whose
// coefficient is not zero at least. On return the answer and its set. tolerance: largest Jacobi move at which
// a point counts as optimal.
[[nodiscard]] SimplexWalkReport walk_simplex(const SimplexWalkProblem& problem, double tolerance,
                                             std::uint16_t iteration_cap, SimplexWalkState& state,
                                             SimplexWalkWorkspace& workspace, std::uint32_t& used,
                                             std::span<float> c);

}  // namespace rig
