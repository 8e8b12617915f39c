#include "firmware_host/companion/world/painted_face.hpp"

#include <algorithm>
#include <deque>
#include <numeric>

#include "firmware_host/companion/world/skin_tone.hpp"

namespace rig::host {

namespace {

// Skin farther from a dot than this is not listed with it: more than a pixel's footprint on skin seen at a
// slant.
constexpr double kDotMargin_mm = 1.0;

Vec3d at(const VertexArrays& arrays, std::int32_t vertex) {
    const auto i = static_cast<std::size_t>(vertex);
    return {static_cast<double>(arrays.x[i]), static_cast<double>(arrays.y[i]),
            static_cast<double>(arrays.z[i])};
}

Vec3d blend(const VertexArrays& arrays, const Int3& vertices, const Float3& barycentric) {
    Vec3d sum{};
    for (std::size_t k = 0; k < 3; ++k)
        sum = sum + static_cast<double>(barycentric[k]) * at(arrays, vertices[k]);
    return sum;
}

double distance_to_segment(const Vec3d& p, const Vec3d& a, const Vec3d& b) {
    const Vec3d along = b - a;
    const double square = dot(along, along);
    const double t = square > 0.0 ? std::clamp(dot(p - a, along) / square, 0.0, 1.0) : 0.0;
    return length(p - (a + t * along));
}

double distance_to_triangle(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const double edge =
        std::min({distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a)});
    const Vec3d normal = cross(b - a, c - a);
    const double square = dot(normal, normal);
    if (!(square > 0.0)) return edge;
    const Vec3d foot = p - (dot(p - a, normal) / square) * normal;
    const bool inside = dot(cross(b - a, foot - a), normal) >= 0.0 &&
                        dot(cross(c - b, foot - b), normal) >= 0.0 &&
                        dot(cross(a - c, foot - c), normal) >= 0.0;
    return inside ? length(p - foot) : edge;
}

// Neighbours on the face get equal or near numbers, so that drawing in this order keeps to few cache lines.
std::uint64_t tile_of(const Rig& rig, const Int3& triangle) {
    constexpr float kTile_mm = 12.0F;
    const Float3& corner = rig.vertices_mm[static_cast<std::size_t>(triangle[0])];
    const auto cell = [](float mm) {
        return static_cast<std::uint64_t>(std::clamp(mm / kTile_mm + 512.0F, 0.0F, 1023.0F));
    };
    return 1024 * (1023 - cell(corner[1])) + cell(corner[0]);
}

// True when the layout's outward normals say that triangles wind clockwise seen from outside.
bool winds_clockwise(const Rig& rig, const MarkerLayout& layout) {
    double agreement = 0.0;
    for (const Int3& t : rig.triangles) {
        for (const LayoutMarker& marker : layout.markers) {
            if (t[0] != marker.vertices[0] && t[1] != marker.vertices[0] && t[2] != marker.vertices[0])
                continue;
            const auto corner = [&](std::size_t k) {
                const Float3& v = rig.vertices_mm[static_cast<std::size_t>(t[k])];
                return Vec3d{static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
            };
            const Vec3d outward{static_cast<double>(marker.normal[0]), static_cast<double>(marker.normal[1]),
                                static_cast<double>(marker.normal[2])};
            agreement += dot(normalised(cross(corner(1) - corner(0), corner(2) - corner(0))), outward);
        }
    }
    return agreement < 0.0;
}

}  // namespace

PaintedFace::PaintedFace(const Rig& rig, const MarkerLayout& layout, double dot_radius_mm, std::uint64_t seed)
    : dot_radius_mm_(dot_radius_mm) {
    rest_.resize(rig.vertices_mm.size());
    for (std::size_t v = 0; v < rig.vertices_mm.size(); ++v) {
        rest_.x[v] = rig.vertices_mm[v][0];
        rest_.y[v] = rig.vertices_mm[v][1];
        rest_.z[v] = rig.vertices_mm[v][2];
    }
    order_triangles(rig, layout);
    pack_shapes(rig);
    for (const LayoutMarker& marker : layout.markers) {
        dots_.push_back(
            {blend(rest_, marker.vertices, marker.barycentric), marker.vertices, marker.barycentric});
    }
    marker_basis_.assign(dots_.size() * shape_count(), Vec3d{});
    for (std::size_t s = 0; s < shape_count(); ++s) {
        VertexArrays moved;
        moved.resize(vertex_count());
        for (std::size_t e = shape_offsets_[s]; e < shape_offsets_[s + 1]; ++e) {
            const auto v = static_cast<std::size_t>(shape_vertices_[e]);
            moved.x[v] += shape_deltas_[4 * e];
            moved.y[v] += shape_deltas_[4 * e + 1];
            moved.z[v] += shape_deltas_[4 * e + 2];
        }
        for (std::size_t m = 0; m < dots_.size(); ++m) {
            marker_basis_[m * shape_count() + s] = blend(moved, dots_[m].vertices, dots_[m].barycentric);
        }
    }
    place_dots(layout);
    SkinTone tone = skin_tone(rig, seed);
    albedo_ = std::move(tone.albedo);
    gloss_ = std::move(tone.gloss);
    PosedFace neutral;
    pose(std::vector<float>(shape_count(), 0.0F), neutral);
    std::vector<Float3> normals(vertex_count());
    for (std::size_t v = 0; v < vertex_count(); ++v) {
        normals[v] = {neutral.normal.x[v], neutral.normal.y[v], neutral.normal.z[v]};
    }
    openness_ = skin_openness(rig, triangles_, normals);
}

void PaintedFace::order_triangles(const Rig& rig, const MarkerLayout& layout) {
    std::vector<bool> skin_vertex(vertex_count(), false);
    for (const LayoutMarker& marker : layout.markers)
        skin_vertex[static_cast<std::size_t>(marker.vertices[0])] = true;
    std::vector<bool> skin_part(256, false);
    for (std::size_t t = 0; t < rig.triangles.size(); ++t) {
        for (const std::int32_t v : rig.triangles[t]) {
            if (skin_vertex[static_cast<std::size_t>(v)]) skin_part[rig.triangle_part[t]] = true;
        }
    }
    const bool clockwise = winds_clockwise(rig, layout);
    std::vector<std::size_t> order(rig.triangles.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return tile_of(rig, rig.triangles[a]) < tile_of(rig, rig.triangles[b]);
    });
    for (const bool skin : {true, false}) {
        for (const std::size_t t : order) {
            if (skin_part[rig.triangle_part[t]] != skin) continue;
            Int3 triangle = rig.triangles[t];
            if (clockwise) std::swap(triangle[1], triangle[2]);
            triangles_.push_back(triangle);
        }
        if (skin) skin_triangle_count_ = triangles_.size();
    }
}

void PaintedFace::pack_shapes(const Rig& rig) {
    shape_offsets_.push_back(0);
    for (const SparseShape& shape : rig.shapes) {
        for (std::size_t i = 0; i < shape.vertices.size(); ++i) {
            shape_vertices_.push_back(shape.vertices[i]);
            shape_deltas_.insert(shape_deltas_.end(),
                                 {shape.delta_mm[i][0], shape.delta_mm[i][1], shape.delta_mm[i][2], 0.0F});
        }
        shape_offsets_.push_back(static_cast<std::uint32_t>(shape_vertices_.size()));
    }
}

// Paint spreads over connected skin from the marker's own vertices, never across the gap between two lips.
void PaintedFace::place_dots(const MarkerLayout& layout) {
    std::vector<std::vector<std::uint32_t>> triangles_at(vertex_count());
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
        for (const std::int32_t v : triangles_[t]) {
            triangles_at[static_cast<std::size_t>(v)].push_back(static_cast<std::uint32_t>(t));
        }
    }
    std::vector<std::vector<std::uint16_t>> lists(triangles_.size());
    for (std::size_t m = 0; m < dots_.size(); ++m) {
        std::deque<std::int32_t> frontier(layout.markers[m].vertices.begin(),
                                          layout.markers[m].vertices.end());
        while (!frontier.empty()) {
            const std::int32_t vertex = frontier.front();
            frontier.pop_front();
            for (const std::uint32_t t : triangles_at[static_cast<std::size_t>(vertex)]) {
                auto& list = lists[t];
                if (!list.empty() && list.back() == m) continue;
                const Int3& corner = triangles_[t];
                const double distance_mm = distance_to_triangle(dots_[m].rest_mm, at(rest_, corner[0]),
                                                                at(rest_, corner[1]), at(rest_, corner[2]));
                if (distance_mm > dot_radius_mm_ + kDotMargin_mm) continue;
                list.push_back(static_cast<std::uint16_t>(m));
                frontier.insert(frontier.end(), corner.begin(), corner.end());
            }
        }
    }
    dot_offsets_.push_back(0);
    for (const auto& list : lists) {
        dot_list_.insert(dot_list_.end(), list.begin(), list.end());
        dot_offsets_.push_back(static_cast<std::uint32_t>(dot_list_.size()));
    }
}

void PaintedFace::pose(std::span<const float> weights, PosedFace& posed) const {
    const std::size_t count = vertex_count();
    posed.gathered.resize(4 * count);
    float* p = posed.gathered.data();
    for (std::size_t v = 0; v < count; ++v) {
        p[4 * v] = rest_.x[v];
        p[4 * v + 1] = rest_.y[v];
        p[4 * v + 2] = rest_.z[v];
        p[4 * v + 3] = 0.0F;
    }
    for (std::size_t s = 0; s < shape_count() && s < weights.size(); ++s) {
        const float w = weights[s];
        if (w == 0.0F) continue;
        for (std::size_t e = shape_offsets_[s]; e < shape_offsets_[s + 1]; ++e) {
            float* q = p + 4 * static_cast<std::size_t>(shape_vertices_[e]);
            const float* d = shape_deltas_.data() + 4 * e;
            for (int k = 0; k < 4; ++k) q[k] += w * d[k];
        }
    }
    posed.position_mm.resize(count);
    for (std::size_t v = 0; v < count; ++v) {
        posed.position_mm.x[v] = p[4 * v];
        posed.position_mm.y[v] = p[4 * v + 1];
        posed.position_mm.z[v] = p[4 * v + 2];
    }
    normals_of(posed);
}

// Area-weighted vertex normals. Reads positions and writes sums in the 4-wide scratch.
void PaintedFace::normals_of(PosedFace& posed) const {
    const std::size_t count = vertex_count();
    const float* x = posed.position_mm.x.data();
    const float* y = posed.position_mm.y.data();
    const float* z = posed.position_mm.z.data();
    float* sum = posed.gathered.data();
    std::fill_n(sum, 4 * count, 0.0F);
    for (const Int3& triangle : triangles_) {
        const auto a = static_cast<std::size_t>(triangle[0]);
        const auto b = static_cast<std::size_t>(triangle[1]);
        const auto c = static_cast<std::size_t>(triangle[2]);
        const float ux = x[b] - x[a], uy = y[b] - y[a], uz = z[b] - z[a];
        const float vx = x[c] - x[a], vy = y[c] - y[a], vz = z[c] - z[a];
        const std::array<float, 4> n = {uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx, 0.0F};
        for (const std::size_t v : {a, b, c}) {
            float* q = sum + 4 * v;
            for (std::size_t k = 0; k < 4; ++k) q[k] += n[k];
        }
    }
    posed.normal.resize(count);
    for (std::size_t v = 0; v < count; ++v) {
        const float* q = sum + 4 * v;
        const float scale = 1.0F / std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + 1e-20F);
        posed.normal.x[v] = q[0] * scale;
        posed.normal.y[v] = q[1] * scale;
        posed.normal.z[v] = q[2] * scale;
    }
}

Vec3d PaintedFace::marker_mm(std::size_t marker, std::span<const float> weights) const {
    Vec3d sum = dots_[marker].rest_mm;
    for (std::size_t s = 0; s < shape_count() && s < weights.size(); ++s) {
        sum = sum + static_cast<double>(weights[s]) * marker_basis_[marker * shape_count() + s];
    }
    return sum;
}

}  // namespace rig::host
