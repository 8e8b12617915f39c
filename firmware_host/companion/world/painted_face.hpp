// The head as the world knows it: rest mesh, shapes, skin tone, hollows, and which triangles carry which dot.
// Built once from a rig; posing it per frame is all that changes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "firmware_host/companion/rig_folder/rig_folder.hpp"
#include "firmware_host/companion/world/vector.hpp"

namespace rig::host {

// Positions or normals of all vertices; separate arrays so that plain loops over them vectorise.
struct VertexArrays {
    std::vector<float> x, y, z;
    void resize(std::size_t count) {
        x.resize(count);
        y.resize(count);
        z.resize(count);
    }
};

struct PosedFace {
    VertexArrays position_mm;     // face frame
    VertexArrays normal;          // unit, outward
    std::vector<float> gathered;  // scratch of posing
};

// One dot painted on the skin: all skin within radius of the centre, measured on the neutral face, so that it
// stretches with the skin.
struct Dot {
    Vec3d rest_mm{};
    Int3 vertices{};
    Float3 barycentric{};
};

class PaintedFace {
  public:
    // Preconditions: what the loaders of the rig folder promise (indices in range, numbers finite, counts
    // consistent).
    PaintedFace(const Rig& rig, const MarkerLayout& layout, double dot_radius_mm, std::uint64_t seed);

    void pose(std::span<const float> weights, PosedFace& posed) const;
    // Marker centre under `weights`, in double and straight from the sparse shapes: neutral + B w.
    [[nodiscard]] Vec3d marker_mm(std::size_t marker, std::span<const float> weights) const;

    [[nodiscard]] std::size_t vertex_count() const { return rest_.x.size(); }
    [[nodiscard]] std::size_t shape_count() const { return shape_offsets_.size() - 1; }
    [[nodiscard]] const std::vector<Int3>& triangles() const { return triangles_; }
    // The first so many of triangles() are of parts that carry markers.
    [[nodiscard]] std::size_t skin_triangle_count() const { return skin_triangle_count_; }
    [[nodiscard]] const VertexArrays& rest_mm() const { return rest_; }
    [[nodiscard]] const std::vector<Dot>& dots() const { return dots_; }
    [[nodiscard]] double dot_radius_mm() const { return dot_radius_mm_; }
    // Dots that may touch a triangle, by index into dots().
    [[nodiscard]] std::span<const std::uint16_t> dots_of(std::size_t triangle) const {
        return {dot_list_.data() + dot_offsets_[triangle],
                dot_offsets_[triangle + 1] - dot_offsets_[triangle]};
    }
    // Diffuse reflectance with hollows darkened, 0..1, and gloss, 0..1, per vertex.
    [[nodiscard]] const std::vector<float>& albedo() const { return albedo_; }
    [[nodiscard]] const std::vector<float>& openness() const { return openness_; }
    [[nodiscard]] const std::vector<float>& gloss() const { return gloss_; }

  private:
    void order_triangles(const Rig& rig, const MarkerLayout& layout);
    void pack_shapes(const Rig& rig);
    void place_dots(const MarkerLayout& layout);
    void normals_of(PosedFace& posed) const;

    VertexArrays rest_;
    std::vector<Int3> triangles_;  // skin first: it hides most of the rest; then by place on the face
    std::size_t skin_triangle_count_ = 0;
    double dot_radius_mm_ = 0.0;
    std::vector<Dot> dots_;
    std::vector<std::uint32_t> dot_offsets_;
    std::vector<std::uint16_t> dot_list_;
    std::vector<std::uint32_t> shape_offsets_;
    std::vector<std::int32_t> shape_vertices_;
    std::vector<float> shape_deltas_;  // 4 per entry: x, y, z, 0
    std::vector<Vec3d> marker_basis_;  // marker * shape_count + shape
    std::vector<float> albedo_;
    std::vector<float> openness_;
    std::vector<float> gloss_;
};

}  // namespace rig::host
