#include "firmware_host/companion/rig_folder/surface.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/unit/firmware_host/companion/rig_folder/small_rig.hpp"

namespace rig::host {
namespace {

Rig one_triangle() {
    Rig rig;
    rig.vertices_mm = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
    rig.triangles = {{0, 1, 2}};
    return rig;
}

TEST(Surface, NearestPointInsideOnEdgesAndAtCorners) {
    const Rig rig = one_triangle();
    struct Row {
        Double3 point, share;
        double distance_mm;
    };
    for (const Row& row : {Row{{1, 1, 3}, {0.5, 0.25, 0.25}, 3.0}, Row{{2, -5, 0}, {0.5, 0.5, 0}, 5.0},
                           Row{{-3, -4, 0}, {1, 0, 0}, 5.0}, Row{{4, 4, 0}, {0, 0.5, 0.5}, std::sqrt(8.0)},
                           Row{{9, -1, 0}, {0, 1, 0}, std::sqrt(26.0)}}) {
        const SurfacePoint nearest = nearest_surface_point(rig, row.point);
        EXPECT_NEAR(nearest.distance_mm, row.distance_mm, 1e-12);
        for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(nearest.barycentric[i], row.share[i], 1e-12);
    }
}

TEST(Surface, TrianglesWithoutAreaStillHaveANearestPoint) {
    Rig rig = one_triangle();
    rig.vertices_mm[2] = {8, 0, 0};
    EXPECT_NEAR(nearest_surface_point(rig, {6, 3, 0}).distance_mm, 3.0, 1e-12);
    rig.vertices_mm[1] = rig.vertices_mm[2] = {0, 0, 0};
    EXPECT_NEAR(nearest_surface_point(rig, {0, 3, 4}).distance_mm, 5.0, 1e-12);
}

TEST(Surface, NearestTrianglesComeInOrderAndOfTheirParts) {
    Rig rig = rig::test::small_rig();
    const Double3 point{4, 7, 9};
    const auto all = nearest_triangles(rig, point, 1000, {});
    ASSERT_EQ(all.size(), rig.triangles.size());
    for (std::size_t i = 1; i < all.size(); ++i) EXPECT_LE(all[i - 1].distance_mm, all[i].distance_mm);
    const SurfacePoint nearest = nearest_surface_point(rig, point);
    EXPECT_EQ(all.front().triangle, nearest.triangle);
    EXPECT_EQ(all.front().barycentric, nearest.barycentric);
    EXPECT_EQ(all.front().distance_mm, nearest.distance_mm);
    EXPECT_EQ(nearest_triangles(rig, point, 3, {}).size(), 3U);
    const auto part = nearest_triangles(rig, point, 1000, {1});
    EXPECT_EQ(static_cast<std::ptrdiff_t>(part.size()), std::ranges::count(rig.triangle_part, 1));
    for (const SurfacePoint& each : part) EXPECT_EQ(rig.triangle_part[each.triangle], 1);
    EXPECT_TRUE(nearest_triangles(rig, point, 5, {200}).empty());
}

TEST(Surface, NormalsAreUnitAndOutward) {
    Rig rig = rig::test::small_rig();
    rig.vertices_mm.push_back({50, 50, 50});  // belongs to no triangle
    const auto normals = vertex_normals(rig);
    for (std::size_t v = 0; v < 9; ++v) {
        EXPECT_NEAR(std::hypot(normals[v][0], normals[v][1], normals[v][2]), 1.0, 1e-12);
        EXPECT_GT(normals[v][2], 0.9);
    }
    EXPECT_EQ(normals[9], (Double3{0, 0, 0}));
}

}  // namespace
}  // namespace rig::host
