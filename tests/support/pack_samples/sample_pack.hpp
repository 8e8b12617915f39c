// Small valid packs, made by arithmetic, for every test that needs one. Their numbers mean nothing.
#pragma once

#include <string>
#include <vector>

#include "core/pack/solve_pack.hpp"

namespace rig::test {

struct SamplePackSize {
    std::uint16_t markers = 4;
    std::uint16_t shapes = 2;
    SolverKind solver = SolverKind::kBoxQp;
    std::uint16_t rbf_dimensions = 2;  // used by SolverKind::kRbf only
    std::uint16_t rbf_centres = 3;
    std::uint8_t cameras = 1;
    std::uint16_t region_examples = 3;  // of the first region; the second has 2
    std::uint8_t reference_marks = 0;   // seen by the first camera, every second one by all
    bool marker_sets = false;           // three: the whole face, all but the last marker, the first two
};

// Owns the numbers; `view` points into them, so the object does not move.
class SamplePack {
  public:
    explicit SamplePack(const SamplePackSize& size);
    SamplePack(const SamplePack&) = delete;
    SamplePack& operator=(const SamplePack&) = delete;

    SolvePack view;
    std::vector<float> neutral, basis, low, high, mean, sigma, gamma;
    std::vector<float> rbf_mean, rbf_basis, rbf_centres, rbf_widths, rbf_weights, rbf_offset;
    std::vector<std::string> names;  // shapes, then markers

    // Of regional solvers: two regions, the first of the pack's own kind, that share marker 2 and shape 0.
    struct Region {
        std::vector<std::uint16_t> markers;
        std::vector<float> marker_blend, origin, examples, shapes, shape_blend;
    };
    std::vector<Region> regions;

    struct Set {
        std::vector<std::uint16_t> markers;
        std::vector<float> mean, modes, variance, residual;
    };
    std::vector<Set> sets;

  private:
    void add_regions(const SamplePackSize& size);
    void add_marker_sets(const SamplePackSize& size);
};

}  // namespace rig::test
