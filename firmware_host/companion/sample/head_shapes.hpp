// The shapes of the built-in head: which skin each one moves, where to and how far.
#pragma once

#include <vector>

#include "core/base/linalg.hpp"
#include "firmware_host/companion/rig_folder/rig_folder.hpp"
#include "firmware_host/companion/sample/head_mesh.hpp"

namespace rig::host {

[[nodiscard]] inline Float3 to_float3(const Vec3& v) {
    return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

// In alphabetical order of their names. A shape ending in _R is the exact mirror of its _L; deltas under
// 0.005 mm are left out.
[[nodiscard]] std::vector<SparseShape> build_head_shapes(const HeadMesh& mesh);

}  // namespace rig::host
