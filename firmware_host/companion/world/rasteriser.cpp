#include "firmware_host/companion/world/rasteriser.hpp"

#include <algorithm>
#include <cmath>

namespace rig::host {

namespace {

// Smaller triangles, in square px, are edge-on or degenerate.
constexpr float kSmallestArea_px2 = 1e-4F;
// Barycentric slack: neighbours round their shared edge differently, and a gap there would show what lies behind.
constexpr float kEdgeSlack = -2e-5F;

struct Bounds {
    int first_column, end_column, first_row, end_row;
};

Bounds bounds_of(const PixelRays& rays, const SeenVertices& seen, const std::array<std::size_t, 3>& v) {
    const auto [left, right] = std::minmax({seen.column[v[0]], seen.column[v[1]], seen.column[v[2]]});
    const auto [top, bottom] = std::minmax({seen.row[v[0]], seen.row[v[1]], seen.row[v[2]]});
    // Distortion bends the edges of a large triangle out of the box of its corners.
    const float bend = 0.02F + 3e-4F * ((right - left) * (right - left) + (bottom - top) * (bottom - top));
    const auto clamped = [](float value, int limit) {
        return static_cast<int>(std::clamp(value, 0.0F, static_cast<float>(limit)));
    };
    return {clamped(std::ceil(left - bend), rays.width_px), clamped(std::floor(right + bend) + 1.0F, rays.width_px),
            clamped(std::ceil(top - bend), rays.height_px), clamped(std::floor(bottom + bend) + 1.0F, rays.height_px)};
}

void draw(const PixelRays& rays, const TrianglePlane& plane, std::uint32_t index, const Bounds& box,
          SeenSurface& surface) {
    for (int row = box.first_row; row < box.end_row; ++row) {
        const std::size_t line = static_cast<std::size_t>(row) * static_cast<std::size_t>(rays.width_px);
        const float* rx = rays.x.data() + line;
        const float* ry = rays.y.data() + line;
        float* depth = surface.inverse_depth.data() + line;
        std::uint32_t* owner = surface.plane.data() + line;
        for (int column = box.first_column; column < box.end_column; ++column) {
            const float dx = rx[column] - plane.ax;
            const float dy = ry[column] - plane.ay;
            const float b = plane.bx * dx + plane.by * dy;
            const float c = plane.cx * dx + plane.cy * dy;
            const float nearness = plane.iz + plane.iz_b * b + plane.iz_c * c;
            const bool inside = (b >= kEdgeSlack) & (c >= kEdgeSlack) & (b + c <= 1.0F - kEdgeSlack);
            const bool wins = inside & (nearness > depth[column]);
            depth[column] = wins ? nearness : depth[column];
            owner[column] = wins ? index : owner[column];
        }
    }
}

}  // namespace

PixelRays::PixelRays(const HelmetCamera& camera) : width_px(camera.width_px), height_px(camera.height_px) {
    const std::size_t count = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
    x.reserve(count);
    y.reserve(count);
    for (int row = 0; row < height_px; ++row) {
        for (int column = 0; column < width_px; ++column) {
            const RaySlope slope = slope_of_pixel(camera, column, row);
            x.push_back(static_cast<float>(camera.f_px * slope.x));
            y.push_back(static_cast<float>(camera.f_px * slope.y));
        }
    }
}

void project(const HelmetCamera& camera, const FaceView& view, const VertexArrays& position_mm, SeenVertices& seen) {
    const std::size_t count = position_mm.x.size();
    for (auto* array : {&seen.x, &seen.y, &seen.inverse_depth, &seen.column, &seen.row, &seen.light}) {
        array->resize(count);
    }
    std::array<float, 9> m{};
    for (std::size_t k = 0; k < 9; ++k) m[k] = static_cast<float>(view.rotation[k]);
    const auto tx = static_cast<float>(view.offset_mm[0]);
    const auto ty = static_cast<float>(view.offset_mm[1]);
    const auto tz = static_cast<float>(view.offset_mm[2]);
    const auto f = static_cast<float>(camera.f_px);
    const auto k1 = static_cast<float>(camera.k1 / (camera.f_px * camera.f_px));
    const auto k2 = static_cast<float>(camera.k2 / (camera.f_px * camera.f_px * camera.f_px * camera.f_px));
    const auto centre_column = static_cast<float>(camera.cx_px);
    const auto centre_row = static_cast<float>(camera.cy_px);
    const float* px = position_mm.x.data();
    const float* py = position_mm.y.data();
    const float* pz = position_mm.z.data();
    float* __restrict__ sx = seen.x.data();
    float* __restrict__ sy = seen.y.data();
    float* __restrict__ si = seen.inverse_depth.data();
    float* __restrict__ sc = seen.column.data();
    float* __restrict__ sr = seen.row.data();
    for (std::size_t v = 0; v < count; ++v) {
        const float x = m[0] * px[v] + m[1] * py[v] + m[2] * pz[v] + tx;
        const float y = m[3] * px[v] + m[4] * py[v] + m[5] * pz[v] + ty;
        const float z = m[6] * px[v] + m[7] * py[v] + m[8] * pz[v] + tz;
        const float inverse = z > 1.0F ? 1.0F / z : 0.0F;
        const float u = f * x * inverse;
        const float w = f * y * inverse;
        const float r2 = u * u + w * w;
        const float stretch = 1.0F + k1 * r2 + k2 * r2 * r2;
        sx[v] = u;
        sy[v] = w;
        si[v] = inverse;
        sc[v] = u * stretch + centre_column;
        sr[v] = w * stretch + centre_row;
    }
}

void rasterise(const PixelRays& rays, std::span<const Int3> triangles, const SeenVertices& seen,
               SeenSurface& surface) {
    const std::size_t pixels = rays.x.size();
    surface.inverse_depth.assign(pixels, 0.0F);
    surface.plane.assign(pixels, kNothing);
    surface.planes.clear();
    surface.triangle.clear();
    surface.first_column = rays.width_px;
    surface.first_row = rays.height_px;
    surface.end_column = 0;
    surface.end_row = 0;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        const std::array<std::size_t, 3> v = {static_cast<std::size_t>(triangles[t][0]),
                                              static_cast<std::size_t>(triangles[t][1]),
                                              static_cast<std::size_t>(triangles[t][2])};
        const float ux = seen.x[v[1]] - seen.x[v[0]], uy = seen.y[v[1]] - seen.y[v[0]];
        const float wx = seen.x[v[2]] - seen.x[v[0]], wy = seen.y[v[2]] - seen.y[v[0]];
        const float area = ux * wy - wx * uy;
        // Counter-clockwise seen from outside is negative where y points down.
        if (!(area < -kSmallestArea_px2)) continue;
        const float ia = seen.inverse_depth[v[0]], ib = seen.inverse_depth[v[1]], ic = seen.inverse_depth[v[2]];
        if (ia <= 0.0F || ib <= 0.0F || ic <= 0.0F) continue;
        const Bounds box = bounds_of(rays, seen, v);
        if (box.first_column >= box.end_column || box.first_row >= box.end_row) continue;
        const float scale = 1.0F / area;
        const float light = seen.light[v[0]];
        const TrianglePlane plane{seen.x[v[0]], seen.y[v[0]], wy * scale, -wx * scale, -uy * scale, ux * scale, ia,
                                  ib - ia,      ic - ia,      light,      seen.light[v[1]] - light,
                                  seen.light[v[2]] - light};
        draw(rays, plane, static_cast<std::uint32_t>(surface.planes.size()), box, surface);
        surface.planes.push_back(plane);
        surface.triangle.push_back(static_cast<std::uint32_t>(t));
        surface.first_column = std::min(surface.first_column, box.first_column);
        surface.end_column = std::max(surface.end_column, box.end_column);
        surface.first_row = std::min(surface.first_row, box.first_row);
        surface.end_row = std::max(surface.end_row, box.end_row);
    }
    if (surface.planes.empty()) surface.first_column = surface.first_row = 0;
}

}  // namespace rig::host
