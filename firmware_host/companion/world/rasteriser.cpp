#include "firmware_host/companion/world/rasteriser.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "firmware_host/companion/world/wide_loops.hpp"

namespace rig::host {

namespace {

// Smaller triangles, in square px, are edge-on or degenerate.
constexpr float kSmallestArea_px2 = 1e-4F;
// Barycentric slack: neighbours round their shared edge differently, and a gap there would show what lies
// behind.
constexpr float kEdgeSlack = -2e-5F;

struct Bounds {
    int first_column, end_column, first_row, end_row;
};

// Everything that rasterise() calls per triangle is inlined by force, to be part of both copies of it.
#define RIG_INLINE [[gnu::always_inline]] inline

RIG_INLINE float least(float a, float b, float c) {
    const float ab = a < b ? a : b;
    return ab < c ? ab : c;
}

RIG_INLINE float most(float a, float b, float c) {
    const float ab = a > b ? a : b;
    return ab > c ? ab : c;
}

// Conversion to int cuts the fraction off; what that rounds outwards by too much costs a pixel's test and no
// more.
RIG_INLINE int clamped(float value, int limit) {
    const auto end = static_cast<float>(limit);
    const float low = value > 0.0F ? value : 0.0F;
    return static_cast<int>(low < end ? low : end);
}

RIG_INLINE Bounds bounds_of(int width_px, int height_px, const SeenVertices& seen,
                            const std::array<std::size_t, 3>& v) {
    const float* column = seen.column.data();
    const float* row = seen.row.data();
    const float left = least(column[v[0]], column[v[1]], column[v[2]]);
    const float right = most(column[v[0]], column[v[1]], column[v[2]]);
    const float top = least(row[v[0]], row[v[1]], row[v[2]]);
    const float bottom = most(row[v[0]], row[v[1]], row[v[2]]);
    // Distortion bends the edges of a large triangle out of the box of its corners.
    const float bend = 0.02F + 3e-4F * ((right - left) * (right - left) + (bottom - top) * (bottom - top));
    return {clamped(left - bend + 0.999F, width_px), clamped(right + bend + 1.0F, width_px),
            clamped(top - bend + 0.999F, height_px), clamped(bottom + bend + 1.0F, height_px)};
}

// Four pixels at once, as a vector that every compiler of this project lays out alike.
using Floats = float __attribute__((vector_size(16)));
using Masks = std::int32_t __attribute__((vector_size(16)));

RIG_INLINE Floats floats(const std::array<float, kWide>& from) {
    Floats v;
    std::memcpy(&v, from.data(), sizeof(v));
    return v;
}

RIG_INLINE bool any(Masks mask) {
    std::array<std::uint64_t, 2> halves{};
    std::memcpy(halves.data(), &mask, sizeof(mask));
    return (halves[0] | halves[1]) != 0;
}

// Each pixel is tested with its own ray, so pixels of a group that lie beyond the box do no harm.
RIG_INLINE void draw(const TrianglePlane& plane, std::uint32_t index, const Bounds& box, PixelGrid& grid) {
    const Masks mine = Masks{} + static_cast<std::int32_t>(index);
    const int first = box.first_column / kWide;
    const int end = (box.end_column + kWide - 1) / kWide;
    for (int row = box.first_row; row < box.end_row; ++row) {
        PixelGroup* groups = grid.row(row);
        for (int g = first; g < end; ++g) {
            PixelGroup& group = groups[g];
            const Floats dx = floats(group.x) - plane.ax;
            const Floats dy = floats(group.y) - plane.ay;
            const Floats b = plane.bx * dx + plane.by * dy;
            const Floats c = plane.cx * dx + plane.cy * dy;
            const Floats nearness = plane.iz + plane.iz_b * b + plane.iz_c * c;
            const Floats old = floats(group.inverse_depth);
            const Masks wins =
                (b >= kEdgeSlack) & (c >= kEdgeSlack) & (b + c <= 1.0F - kEdgeSlack) & (nearness > old);
            if (!any(wins)) continue;
            Masks owner;
            std::memcpy(&owner, group.plane.data(), sizeof(owner));
            const Floats depth = wins ? nearness : old;
            owner = wins ? mine : owner;
            std::memcpy(group.inverse_depth.data(), &depth, sizeof(depth));
            std::memcpy(group.plane.data(), &owner, sizeof(owner));
        }
    }
}

constexpr int kTile_px = 8;
static_assert(kTile_px % kWide == 0);

int tiles_across(const PixelGrid& grid) {
    return (grid.width_px() + kTile_px - 1) / kTile_px;
}

// Least inverse depth of each tile; 0 outside of the drawn rows and columns, where nothing hides anything.
// The part of a tile beyond the image is never covered, so a tile at the rim hides nothing unless it is
// whole.
void measure_cover(const PixelGrid& grid, const SeenSurface& drawn, std::vector<float>& cover) {
    const int across = tiles_across(grid);
    const int down = (grid.height_px() + kTile_px - 1) / kTile_px;
    cover.assign(static_cast<std::size_t>(across) * static_cast<std::size_t>(down), 0.0F);
    for (int row = drawn.first_row / kTile_px; row < drawn.end_row / kTile_px; ++row) {
        for (int column = drawn.first_column / kTile_px;
             column < (drawn.end_column + kTile_px - 1) / kTile_px; ++column) {
            std::array<float, kWide> least_of = {1.0F, 1.0F, 1.0F, 1.0F};  // nothing is nearer than 1 mm
            for (int y = row * kTile_px; y < (row + 1) * kTile_px; ++y) {
                const PixelGroup* groups = grid.row(y);
                const int end = std::min((column + 1) * kTile_px, grid.width_px());
                for (int x = column * kTile_px; x < end; x += kWide) {
                    const auto& depth = groups[x / kWide].inverse_depth;
                    for (std::size_t k = 0; k < kWide; ++k)
                        least_of[k] = depth[k] < least_of[k] ? depth[k] : least_of[k];
                }
            }
            cover[static_cast<std::size_t>(row * across + column)] =
                std::min({least_of[0], least_of[1], least_of[2], least_of[3]});
        }
    }
}

RIG_INLINE bool is_covered(const Bounds& box, float nearest, int across, const std::vector<float>& cover) {
    for (int y = box.first_row / kTile_px; y <= (box.end_row - 1) / kTile_px; ++y) {
        for (int x = box.first_column / kTile_px; x <= (box.end_column - 1) / kTile_px; ++x) {
            if (cover[static_cast<std::size_t>(y * across + x)] < nearest) return false;
        }
    }
    return true;
}

}  // namespace

PixelGrid::PixelGrid(const HelmetCamera& camera)
    : width_px_(camera.width_px),
      height_px_(camera.height_px),
      stride_(static_cast<std::size_t>((camera.width_px + kWide - 1) / kWide)),
      groups_(stride_ * static_cast<std::size_t>(camera.height_px)) {
    constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN();
    for (int y = 0; y < height_px_; ++y) {
        for (int x = 0; x < static_cast<int>(stride_) * kWide; ++x) {
            const RaySlope slope = slope_of_pixel(camera, x, y);
            PixelGroup& group = row(y)[x / kWide];
            const auto lane = static_cast<std::size_t>(x % kWide);
            const bool inside = x < width_px_;
            group.x[lane] = inside ? static_cast<float>(camera.f_px * slope.x) : kNowhere;
            group.y[lane] = inside ? static_cast<float>(camera.f_px * slope.y) : kNowhere;
        }
    }
    note_drawn(0, width_px_, 0, height_px_);
    clear();
}

void PixelGrid::clear() {
    for (int y = first_row_; y < end_row_; ++y) {
        PixelGroup* groups = row(y);
        for (int g = first_column_ / kWide; g < (end_column_ + kWide - 1) / kWide; ++g) {
            groups[g].inverse_depth.fill(0.0F);
            groups[g].plane.fill(kNothing);
        }
    }
    first_column_ = width_px_;
    first_row_ = height_px_;
    end_column_ = 0;
    end_row_ = 0;
}

void PixelGrid::note_drawn(int first_column, int end_column, int first_row, int end_row) {
    first_column_ = std::min(first_column_, first_column);
    end_column_ = std::max(end_column_, end_column);
    first_row_ = std::min(first_row_, first_row);
    end_row_ = std::max(end_row_, end_row);
}

RIG_WIDE_LOOPS void project(const HelmetCamera& camera, const FaceView& view, const VertexArrays& position_mm,
                            SeenVertices& seen) {
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

RIG_WIDE_LOOPS void rasterise(std::span<const Int3> triangles, std::size_t front_count,
                              const SeenVertices& seen, PixelGrid& grid, SeenSurface& surface) {
    grid.clear();
    surface.planes.clear();
    surface.triangle.clear();
    surface.first_column = grid.width_px();
    surface.first_row = grid.height_px();
    surface.end_column = 0;
    surface.end_row = 0;
    const int across = tiles_across(grid);
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        if (t == front_count) measure_cover(grid, surface, surface.cover);
        const std::array<std::size_t, 3> v = {static_cast<std::size_t>(triangles[t][0]),
                                              static_cast<std::size_t>(triangles[t][1]),
                                              static_cast<std::size_t>(triangles[t][2])};
        const float ux = seen.x[v[1]] - seen.x[v[0]], uy = seen.y[v[1]] - seen.y[v[0]];
        const float wx = seen.x[v[2]] - seen.x[v[0]], wy = seen.y[v[2]] - seen.y[v[0]];
        const float area = ux * wy - wx * uy;
        // Counter-clockwise seen from outside is negative where y points down.
        if (!(area < -kSmallestArea_px2)) continue;
        const float ia = seen.inverse_depth[v[0]], ib = seen.inverse_depth[v[1]],
                    ic = seen.inverse_depth[v[2]];
        if (ia <= 0.0F || ib <= 0.0F || ic <= 0.0F) continue;
        const Bounds box = bounds_of(grid.width_px(), grid.height_px(), seen, v);
        if (box.first_column >= box.end_column || box.first_row >= box.end_row) continue;
        if (t >= front_count && is_covered(box, most(ia, ib, ic), across, surface.cover)) continue;
        const float scale = 1.0F / area;
        const float light = seen.light[v[0]];
        const TrianglePlane plane{seen.x[v[0]],
                                  seen.y[v[0]],
                                  wy * scale,
                                  -wx * scale,
                                  -uy * scale,
                                  ux * scale,
                                  ia,
                                  ib - ia,
                                  ic - ia,
                                  light,
                                  seen.light[v[1]] - light,
                                  seen.light[v[2]] - light};
        draw(plane, static_cast<std::uint32_t>(surface.planes.size()), box, grid);
        surface.planes.push_back(plane);
        surface.triangle.push_back(static_cast<std::uint32_t>(t));
        surface.first_column = std::min(surface.first_column, box.first_column);
        surface.end_column = std::max(surface.end_column, box.end_column);
        surface.first_row = std::min(surface.first_row, box.first_row);
        surface.end_row = std::max(surface.end_row, box.end_row);
    }
    if (surface.planes.empty()) surface.first_column = surface.first_row = 0;
    grid.note_drawn(surface.first_column, surface.end_column, surface.first_row, surface.end_row);
}

}  // namespace rig::host
