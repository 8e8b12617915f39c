// Points and normals on the surface of a neutral mesh, in double precision.
#pragma once

#include <array>
#include <cstddef>
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

// Unit, outward where triangles run counter-clockwise, weighted by area; zero for vertices without a
// triangle.
[[nodiscard]] std::vector<Double3> vertex_normals(const Rig& rig);

}  // namespace rig::host
