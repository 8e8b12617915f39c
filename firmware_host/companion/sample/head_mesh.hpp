// The mesh of the built-in head: a grid of skin with slits for mouth and eyes, pockets behind them, teeth,
// eyeballs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/linalg.hpp"
#include "firmware_host/companion/rig_folder/rig_folder.hpp"

namespace rig::host {

enum class HeadPart : std::uint8_t {
    kFace,
    kBackHead,
    kMouthInside,
    kUpperTeeth,
    kLowerTeeth,
    kLeftEyeball,
    kRightEyeball
};

// Which side of a slit a vertex hangs on.
enum class SlitSide : std::uint8_t { kAbove, kBelow };

struct HeadVertex {
    Vec3 rest_mm = Vec3::Zero();
    HeadPart part = HeadPart::kFace;
    SlitSide mouth = SlitSide::kAbove;
    SlitSide eye = SlitSide::kAbove;
    Vec3 anchor_mm = Vec3::Zero();  // where the skin is that it follows; itself for skin
    double follow = 1.0;            // how much of the anchor's motion it makes
    std::size_t mirror = 0;         // index of the vertex at (-x, y, z)
};

struct HeadMesh {
    std::vector<HeadVertex> vertices;
    std::vector<Int3> triangles;  // counter-clockwise from outside
    std::vector<std::uint8_t> triangle_part;
    std::vector<std::string> parts;  // by the number of HeadPart
};

// Mirrored exactly: vertex v is at (-x, y, z) of its mirror, and triangles are too. Same bits on every
// machine.
[[nodiscard]] HeadMesh build_head_mesh();

}  // namespace rig::host
