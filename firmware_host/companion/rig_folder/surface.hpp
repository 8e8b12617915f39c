// Points and normals on the surface of a neutral mesh, in double precision.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "firmware_host/companion/rig_folder/rig_folder.hpp"

namespace rig::host {

using Double3 = std::array<double, 3>;

struct SurfacePoint {
    std::size_t triangle = 0;
    Double3 barycentric{};
    double distance_mm = 0.0;
};

// The point of any triangle that is nearest to `point_mm`; the first one where several are. The rig has
// triangles.
[[nodiscard]] SurfacePoint nearest_surface_point(const Rig& rig, const Double3& point_mm);

// The `count` triangles of the listed parts (all parts where the list is empty) nearest to `point_mm`,
// nearest first, ties by index; fewer when there are not as many.
[[nodiscard]] std::vector<SurfacePoint> nearest_triangles(const Rig& rig, const Double3& point_mm,
                                                          std::size_t count,
                                                          const std::vector<std::uint8_t>& parts);

// Unit, outward where triangles run counter-clockwise, weighted by area; zero for vertices without a
// triangle.
[[nodiscard]] std::vector<Double3> vertex_normals(const Rig& rig);

// Writes a marker's neutral position and normal from its vertices and weights; `normals` as above. False when
// there is no normal: no face with an area is there.
[[nodiscard]] bool settle_on_mesh(const Rig& rig, const std::vector<Double3>& normals, LayoutMarker& marker);

}  // namespace rig::host
