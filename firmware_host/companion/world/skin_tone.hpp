// What the skin reflects before any light falls on it: tone per vertex and how open a vertex is to its
// surroundings.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "firmware_host/companion/rig_folder/rig_folder.hpp"

namespace rig::host {

struct SkinTone {
    std::vector<float> albedo;  // 0..1
    std::vector<float> gloss;   // 0..1
};

// Blotches, fine grain, lips, brows; eyes, teeth and gums by the names of the rig's parts. Deterministic by
// seed.
[[nodiscard]] SkinTone skin_tone(const Rig& rig, std::uint64_t seed);

// Fraction, 0..1, of a vertex's surroundings that the rest of the neutral head leaves open (ambient occlusion
// by depth maps from many sides): low in nostrils and mouth.
[[nodiscard]] std::vector<float> skin_openness(const Rig& rig, std::span<const Int3> triangles,
                                               std::span<const Float3> normals);

}  // namespace rig::host
