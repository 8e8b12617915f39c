#include "firmware_host/companion/sample/head_mesh.hpp"
#include "firmware_host/companion/sample/head_shapes.hpp"
#include "firmware_host/companion/sample/sample.hpp"

namespace rig::host {

Rig sample_rig() {
    HeadMesh mesh = build_head_mesh();
    Rig rig;
    for (const HeadVertex& vertex : mesh.vertices) rig.vertices_mm.push_back(to_float3(vertex.rest_mm));
    rig.shapes = build_head_shapes(mesh);
    rig.triangles = std::move(mesh.triangles);
    rig.triangle_part = std::move(mesh.triangle_part);
    rig.parts = std::move(mesh.parts);
    return rig;
}

}  // namespace rig::host
