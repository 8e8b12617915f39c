#include "tests/support/pack_samples/tiny_rig.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace rig::test {

namespace {

constexpr int kSide = 20;  // vertices along an edge of the sheet
constexpr float kStepMm = 7.0F;

host::Float3 vertex(int column, int row) {
    const float x = kStepMm * (static_cast<float>(column) - 9.5F);
    const float y = kStepMm * (static_cast<float>(row) - 9.5F);
    return {x, y, 30.0F - 0.004F * (x * x + y * y)};
}

host::SparseShape bulge(const host::Rig& rig, std::size_t index) {
    host::SparseShape shape;
    shape.name = "bulge_" + std::to_string(index);
    const auto middle = rig.vertices_mm[(index * 89 + 27) % rig.vertices_mm.size()];
    const auto sideways = static_cast<float>(std::sin(static_cast<double>(index)));
    for (std::size_t v = 0; v < rig.vertices_mm.size(); ++v) {
        const float dx = rig.vertices_mm[v][0] - middle[0];
        const float dy = rig.vertices_mm[v][1] - middle[1];
        const float height = 6.0F * std::exp(-(dx * dx + dy * dy) / 800.0F);
        if (height < 0.01F) continue;
        shape.vertices.push_back(static_cast<std::int32_t>(v));
        shape.delta_mm.push_back({sideways * height, 0.3F * height, height});
    }
    return shape;
}

}  // namespace

TinyRig tiny_rig(std::size_t marker_count, std::size_t shape_count, std::size_t frame_count) {
    TinyRig out;
    host::Rig& rig = out.rig;
    for (int row = 0; row < kSide; ++row) {
        for (int column = 0; column < kSide; ++column) rig.vertices_mm.push_back(vertex(column, row));
    }
    for (std::int32_t row = 0; row + 1 < kSide; ++row) {
        for (std::int32_t column = 0; column + 1 < kSide; ++column) {
            const std::int32_t v = row * kSide + column;
            rig.triangles.push_back({v, v + 1, v + kSide});
            rig.triangles.push_back({v + 1, v + kSide + 1, v + kSide});
        }
    }
    rig.parts = {"face"};
    rig.triangle_part.assign(rig.triangles.size(), 0);
    for (std::size_t i = 0; i < shape_count; ++i) rig.shapes.push_back(bulge(rig, i));
    for (std::size_t k = 0; k < marker_count; ++k) {
        host::LayoutMarker marker;
        marker.name = "m" + std::to_string(k);
        marker.vertices = rig.triangles[(k * 47 + 5) % rig.triangles.size()];
        marker.barycentric = {1.0F, 0.0F, 0.0F};
        marker.neutral_mm = rig.vertices_mm[static_cast<std::size_t>(marker.vertices[0])];
        marker.normal = {0.0F, 0.0F, 1.0F};
        out.layout.markers.push_back(marker);
    }
    host::Take& take = out.take;
    take.frame_count = frame_count;
    for (const host::SparseShape& shape : rig.shapes) take.shape_names.push_back(shape.name);
    for (std::size_t f = 0; f < frame_count; ++f) {
        for (std::size_t i = 0; i < shape_count; ++i) {
            const double turns = static_cast<double>(f) / (50.0 + 17.0 * static_cast<double>(i)) +
                                 0.37 * static_cast<double>(i);
            take.weights.push_back(
                static_cast<float>(std::max(0.0, std::sin(2.0 * std::numbers::pi * turns))));
        }
    }
    return out;
}

}  // namespace rig::test
