#include "tests/unit/firmware_host/companion/world/test_head.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace rig::test {

namespace {

constexpr int kCells = 30;
constexpr float kCell_mm = 4.0F;
constexpr float kSheet_mm = 20.0F;

void add_sheet(host::Rig& rig, float z_mm, float left_mm, int columns, const char* part) {
    const auto first = static_cast<std::int32_t>(rig.vertices_mm.size());
    for (int row = 0; row <= kCells; ++row) {
        for (int column = 0; column <= columns; ++column) {
            rig.vertices_mm.push_back({left_mm + kCell_mm * static_cast<float>(column),
                                       kCell_mm * static_cast<float>(row - kCells / 2), z_mm});
        }
    }
    const auto part_index = static_cast<std::uint8_t>(rig.parts.size());
    rig.parts.push_back(part);
    for (int row = 0; row < kCells; ++row) {
        for (int column = 0; column < columns; ++column) {
            const std::int32_t a = first + row * (columns + 1) + column;
            const std::int32_t above = a + columns + 1;
            rig.triangles.push_back({a, a + 1, above + 1});
            rig.triangles.push_back({a, above + 1, above});
            rig.triangle_part.insert(rig.triangle_part.end(), 2, part_index);
        }
    }
}

}  // namespace

TestHead flat_head(bool plate) {
    TestHead head;
    add_sheet(head.rig, kSheet_mm, -0.5F * kCells * kCell_mm, kCells, "M_Face");
    const std::size_t skin = head.rig.vertices_mm.size();
    if (plate) add_sheet(head.rig, kSheet_mm + 40.0F, -60.0F, 13, "M_Plate");
    host::SparseShape lift{"lift", {}, {}};
    host::SparseShape stretch{"stretch", {}, {}};
    for (std::size_t v = 0; v < skin; ++v) {
        lift.vertices.push_back(static_cast<std::int32_t>(v));
        lift.delta_mm.push_back({0.0F, 10.0F, 0.0F});
        stretch.vertices.push_back(static_cast<std::int32_t>(v));
        stretch.delta_mm.push_back({0.1F * head.rig.vertices_mm[v][0], 0.0F, 0.0F});
    }
    head.rig.shapes = {lift, stretch};
    for (int row = -1; row <= 1; ++row) {
        for (int column = -1; column <= 1; ++column) {
            // 30 mm is seven and a half cells: inside a triangle and not at a vertex.
            const float x = 30.0F * static_cast<float>(column), y = 30.0F * static_cast<float>(row);
            const float u = x / kCell_mm + 0.5F * kCells, v = y / kCell_mm + 0.5F * kCells;
            const auto cx = static_cast<std::int32_t>(u), cy = static_cast<std::int32_t>(v);
            const float fx = u - static_cast<float>(cx), fy = v - static_cast<float>(cy);
            const std::int32_t a = cy * (kCells + 1) + cx;
            host::LayoutMarker marker;
            marker.name = "M" + std::to_string(head.layout.markers.size());
            marker.vertices = {a, a + 1, a + kCells + 2};
            marker.barycentric = {1.0F - fx, fx - fy, fy};
            marker.neutral_mm = {x, y, kSheet_mm};
            marker.normal = {0.0F, 0.0F, 1.0F};
            head.layout.markers.push_back(marker);
        }
    }
    head.take = {{"lift", "stretch"}, 60.0, 40, {}};
    for (int frame = 0; frame < 40; ++frame) {
        head.take.weights.push_back(0.01F * static_cast<float>(frame));
        head.take.weights.push_back(0.5F + 0.5F * std::sin(0.4F * static_cast<float>(frame)));
    }
    return head;
}

host::HelmetCamera straight_camera(double k1, double k2) {
    host::HelmetCamera camera;
    camera.name = "a";
    camera.width_px = 256;
    camera.height_px = 256;
    camera.f_px = 600.0;
    camera.cx_px = 126.3;
    camera.cy_px = 129.6;
    camera.k1 = k1;
    camera.k2 = k2;
    camera.rotation = {1, 0, 0, 0, -1, 0, 0, 0, -1};
    camera.centre_mm = {0.0, 0.0, 250.0};
    return camera;
}

std::unique_ptr<host::World> make_world(const TestHead& head, const host::WorldConfig& config) {
    auto world = host::World::create(head.rig, head.layout, head.take, config);
    if (!world) {
        std::fputs(world.error().message.c_str(), stderr);
        std::abort();
    }
    return std::move(*world);
}

host::WorldConfig clean_config(const host::HelmetCamera& camera) {
    host::WorldConfig config;
    config.cameras = {camera};
    config.slip = host::SlipKind::kNone;
    config.defocus_px = 0.0;
    config.vignetting = 0.0;
    config.noise = 0.0;
    return config;
}

}  // namespace rig::test
