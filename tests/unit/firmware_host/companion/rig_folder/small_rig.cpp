#include "tests/unit/firmware_host/companion/rig_folder/small_rig.hpp"

namespace rig::test {

host::Rig small_rig() {
    host::Rig rig;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            rig.vertices_mm.push_back({10.0F * static_cast<float>(column), 10.0F * static_cast<float>(row),
                                       column == 1 ? 2.5F : 0.0F});
        }
    }
    for (std::int32_t row = 0; row < 2; ++row) {
        for (std::int32_t column = 0; column < 2; ++column) {
            const std::int32_t corner = 3 * row + column;
            rig.triangles.push_back({corner, corner + 1, corner + 4});
            rig.triangles.push_back({corner, corner + 4, corner + 3});
        }
    }
    rig.triangle_part = {0, 0, 0, 0, 1, 1, 1, 1};
    rig.parts = {"face", "eye"};
    rig.shapes = {
        {.name = "jawOpen", .vertices = {0, 1, 2}, .delta_mm = {{0, -1, 0}, {0, -2, 0.5F}, {0, -1, 0}}},
        {.name = "browUp", .vertices = {8, 6}, .delta_mm = {{0.25F, 3, 0}, {-0.25F, 3, 0}}}};
    return rig;
}

host::MarkerLayout small_layout(const host::Rig& rig) {
    host::MarkerLayout layout;
    const auto add = [&](const char* name, host::Int3 vertices, host::Float3 share) {
        host::LayoutMarker marker{
            .name = name, .vertices = vertices, .barycentric = share, .normal = {0, 0, 1}};
        for (std::size_t corner = 0; corner < 3; ++corner) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                marker.neutral_mm[axis] +=
                    share[corner] * rig.vertices_mm[static_cast<std::size_t>(vertices[corner])][axis];
            }
        }
        layout.markers.push_back(marker);
    };
    add("A", {0, 0, 0}, {1, 0, 0});
    add("B", {2, 2, 2}, {1, 0, 0});
    add("C", {8, 8, 8}, {1, 0, 0});
    add("D", {6, 6, 6}, {1, 0, 0});
    add("E", {0, 1, 4}, {0.5F, 0.25F, 0.25F});
    return layout;
}

}  // namespace rig::test
