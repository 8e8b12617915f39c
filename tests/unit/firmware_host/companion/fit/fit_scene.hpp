// A tiny rig whose markers sit at known places inside triangles, a layout that is off by a known distance,
// and the take that cameras in another frame and scale would have recorded.
#pragma once

#include "firmware_host/companion/fit/marker_take.hpp"
#include "firmware_host/companion/fit/similarity.hpp"
#include "tests/support/pack_samples/tiny_rig.hpp"
#include "tests/support/random.hpp"

namespace rig::test {

struct FitSceneOptions {
    std::size_t markers = 30;
    std::size_t shapes = 6;
    std::size_t frames = 300;  // after the neutral ones
    std::size_t neutral = 20;
    double misplaced_mm = 1.5;
    double noise_mm = 0.05;
    double hidden_share = 0.0;  // of marker positions after the neutral frames
    double slip_mm = 0.0;       // amplitude of a slow slip of the head
    host::Similarity take_from_face;
    std::uint64_t seed = 1;
};

struct FitScene {
    TinyRig tiny;  // its layout is the true one
    host::MarkerLayout rough;
    host::MarkerTake take;
};

[[nodiscard]] FitScene fit_scene(const FitSceneOptions& options);

// Root mean square distance of two layouts' neutral positions, mm.
[[nodiscard]] double layout_distance_mm(const host::MarkerLayout& a, const host::MarkerLayout& b);

}  // namespace rig::test
