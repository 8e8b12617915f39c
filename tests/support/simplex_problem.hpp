// Random simplex-constrained problems for tests and benches: face-like regions, and degenerate ones.
#pragma once

#include <cstddef>
#include <vector>

#include "core/solve/simplex_qp.hpp"
#include "tests/support/random.hpp"
#include "tests/support/reference_simplex_qp.hpp"

namespace rig::test {

// Rows padded for core's kernels, in memory that starts at a cache line. Owns what view() points into.
class SimplexProblem {
  public:
    // `raw` [rows x count] absolute positions of the examples; the mean is taken out in double.
    SimplexProblem(std::size_t rows, std::size_t count, const std::vector<double>& raw);

    // `position` [rows] absolute; NaN: hidden.
    void measure(const std::vector<double>& position);
    void weigh(std::vector<float> row_weight) { weight_ = std::move(row_weight); }
    [[nodiscard]] SimplexQpProblem view() const;
    // The same numbers as core reads them, in long double; hidden rows have weight 0.
    [[nodiscard]] ReferenceSimplexQp reference() const;

    [[nodiscard]] std::size_t rows() const { return rows_; }
    [[nodiscard]] std::size_t count() const { return count_; }

  private:
    struct alignas(64) Lanes {
        float values[kLaneFloats];
    };
    std::size_t rows_;
    std::size_t count_;
    std::vector<double> mean_;
    std::vector<Lanes> examples_;
    std::vector<Lanes> gram_;
    std::vector<float> target_;
    std::vector<float> weight_;
};

struct SimplexFaceOptions {
    std::size_t rows = 60;
    std::size_t count = 12;
    double neutral_mm = 60.0;     // size of the positions
    double motion_mm = 6.0;       // size of the examples' motion
    double similarity = 0.5;      // of examples of one family: 0 unrelated, towards 1 alike
    std::size_t duplicates = 0;   // the last ones repeat earlier ones exactly
    std::size_t affine = 0;       // ... lie between two earlier ones
    double near_duplicate = 0.0;  // > 0: the last one differs from the first by this share of the motion
};

// Examples [rows x count] in absolute positions.
[[nodiscard]] std::vector<double> simplex_examples(const SimplexFaceOptions& options, SeededRandom& random);

// Coefficients that wander smoothly over the simplex, most of them near 0: frame f of a trajectory.
class SimplexTrajectory {
  public:
    SimplexTrajectory(std::size_t count, SeededRandom& random);
    [[nodiscard]] std::vector<double> at(double frame) const;

  private:
    std::vector<double> frequency_;
    std::vector<double> phase_;
};

}  // namespace rig::test
