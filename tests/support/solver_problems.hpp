// Trajectories for measuring solvers: a cloud of markers, shapes that move it smoothly in families of similar
// ones, and a performance of overlapping events. Not a face, but as hard as one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace rig::test {

struct SolverTrajectory {
    std::size_t rows = 0;                      // R = 3 markers
    std::size_t shapes = 0;                    // N
    std::vector<double> basis;                 // B [R x N], mean diagonal of B^T B = 1
    std::vector<std::vector<double>> targets;  // t - b0 [frames][R]: B w + 0.2 % noise
    std::vector<std::vector<double>> weights;  // w [frames][N], 0..1
};

// Columns are local smooth deltas in families of 2 to 4 with pairwise correlation up to 0.9; 5 to 20
// raised-cosine events are active at any time, 0.5 to 1.5 s long at 60 Hz.
[[nodiscard]] SolverTrajectory make_solver_trajectory(std::size_t rows, std::size_t shapes,
                                                      std::size_t frames, std::uint64_t seed);

// B^T B + diagonal * I [N x N] of a basis rounded to float, summed in double.
[[nodiscard]] std::vector<double> gram_of(const SolverTrajectory& problem, double diagonal);

}  // namespace rig::test
