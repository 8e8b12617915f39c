#include "firmware_host/companion/rig_folder/surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace rig::host {

namespace {

Double3 minus(const Double3& a, const Double3& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

double dot(const Double3& a, const Double3& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Double3 cross(const Double3& a, const Double3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Double3 vertex_at(const Rig& rig, std::int32_t index) {
    const Float3& v = rig.vertices_mm[static_cast<std::size_t>(index)];
    return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

using Triangle = std::array<Double3, 3>;

// 0..1, where on the way from `a` to `b` the point is nearest; 0 where both are one.
double along(const Double3& a, const Double3& b, const Double3& p) {
    const Double3 ab = minus(b, a);
    const double length2 = dot(ab, ab);
    if (!(length2 > 0.0)) return 0.0;
    return std::fmin(1.0, std::fmax(0.0, dot(minus(p, a), ab) / length2));
}

double distance2_at(const Triangle& corners, const Double3& share, const Double3& p) {
    double sum = 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double x =
            share[0] * corners[0][axis] + share[1] * corners[1][axis] + share[2] * corners[2][axis];
        sum += (x - p[axis]) * (x - p[axis]);
    }
    return sum;
}

// The foot of the perpendicular where it falls inside, else the best of the three edges.
Double3 nearest_share(const Triangle& corners, const Double3& p) {
    const Double3 normal = cross(minus(corners[1], corners[0]), minus(corners[2], corners[0]));
    const double area2 = dot(normal, normal);
    if (area2 > 0.0) {
        const auto share_of = [&](std::size_t i) {
            const Double3& from = corners[(i + 1) % 3];
            return dot(cross(minus(corners[(i + 2) % 3], from), minus(p, from)), normal) / area2;
        };
        const Double3 inside{share_of(0), share_of(1), share_of(2)};
        if (inside[0] >= 0.0 && inside[1] >= 0.0 && inside[2] >= 0.0) return inside;
    }
    Double3 best{};
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3;
        const double t = along(corners[i], corners[j], p);
        Double3 share{};
        share[i] = 1.0 - t;
        share[j] = t;
        const double distance2 = distance2_at(corners, share, p);
        if (distance2 < least) {
            least = distance2;
            best = share;
        }
    }
    return best;
}

Triangle corners_of(const Rig& rig, std::size_t triangle) {
    const Int3& t = rig.triangles[triangle];
    return {vertex_at(rig, t[0]), vertex_at(rig, t[1]), vertex_at(rig, t[2])};
}

}  // namespace

SurfacePoint nearest_surface_point(const Rig& rig, const Double3& point_mm) {
    SurfacePoint best;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t t = 0; t < rig.triangles.size(); ++t) {
        const Triangle corners = corners_of(rig, t);
        const Double3 share = nearest_share(corners, point_mm);
        const double distance2 = distance2_at(corners, share, point_mm);
        if (distance2 >= least) continue;
        least = distance2;
        best = {.triangle = t, .barycentric = share, .distance_mm = 0.0};
    }
    best.distance_mm = std::sqrt(least);
    return best;
}

std::vector<SurfacePoint> nearest_triangles(const Rig& rig, const Double3& point_mm, std::size_t count,
                                            const std::vector<std::uint8_t>& parts) {
    std::vector<SurfacePoint> all;
    for (std::size_t t = 0; t < rig.triangles.size(); ++t) {
        if (!parts.empty() && std::ranges::find(parts, rig.triangle_part[t]) == parts.end()) continue;
        const Triangle corners = corners_of(rig, t);
        const Double3 share = nearest_share(corners, point_mm);
        all.push_back({t, share, std::sqrt(distance2_at(corners, share, point_mm))});
    }
    const auto kept = all.begin() + static_cast<std::ptrdiff_t>(std::min(count, all.size()));
    std::ranges::partial_sort(all, kept, {},
                              [](const SurfacePoint& p) { return std::pair{p.distance_mm, p.triangle}; });
    all.erase(kept, all.end());
    return all;
}

std::vector<Double3> vertex_normals(const Rig& rig) {
    std::vector<Double3> normals(rig.vertices_mm.size(), Double3{});
    for (std::size_t t = 0; t < rig.triangles.size(); ++t) {
        const Triangle c = corners_of(rig, t);
        const Double3 twice_area = cross(minus(c[1], c[0]), minus(c[2], c[0]));
        for (const std::int32_t v : rig.triangles[t]) {
            for (std::size_t axis = 0; axis < 3; ++axis)
                normals[static_cast<std::size_t>(v)][axis] += twice_area[axis];
        }
    }
    for (Double3& normal : normals) {
        const double length = std::sqrt(dot(normal, normal));
        if (!(length > 0.0)) continue;
        for (double& x : normal) x /= length;
    }
    return normals;
}

bool settle_on_mesh(const Rig& rig, const std::vector<Double3>& normals, LayoutMarker& marker) {
    Double3 normal{};
    Double3 point{};
    for (std::size_t corner = 0; corner < 3; ++corner) {
        const auto v = static_cast<std::size_t>(marker.vertices[corner]);
        const auto share = static_cast<double>(marker.barycentric[corner]);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            normal[axis] += share * normals[v][axis];
            point[axis] += share * static_cast<double>(rig.vertices_mm[v][axis]);
        }
    }
    const double length = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    if (!(length > 1.0e-6)) return false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        marker.normal[axis] = static_cast<float>(normal[axis] / length);
        marker.neutral_mm[axis] = static_cast<float>(point[axis]);
    }
    return true;
}

}  // namespace rig::host
