// Which triangle each pixel of a distorted camera sees: a z-buffer whose inside test runs in undistorted coordinates, so
// that lens distortion is exact at every pixel and not only at vertices.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "firmware_host/companion/rig_folder/rig_folder.hpp"
#include "firmware_host/companion/world/helmet.hpp"
#include "firmware_host/companion/world/painted_face.hpp"

namespace rig::host {

// Undistorted image plane, in pixels from the optical axis ("ideal px": f X / Z, f Y / Z), for every pixel. NaN where
// the lens formula does not reach: such a pixel sees nothing.
struct PixelRays {
    explicit PixelRays(const HelmetCamera& camera);
    int width_px;
    int height_px;
    std::vector<float> x, y;
};

// X_cam = rotation X_face + offset_mm: slip and camera in one.
struct FaceView {
    Mat3d rotation = kIdentity3;
    Vec3d offset_mm{};
};

// Vertices as one camera sees them.
struct SeenVertices {
    std::vector<float> x, y;      // ideal px
    std::vector<float> inverse_depth;  // 1/mm; 0 behind the camera
    std::vector<float> column, row;    // distorted px, for bounds only
    std::vector<float> light;     // radiance, DN at nominal exposure
};

void project(const HelmetCamera& camera, const FaceView& view, const VertexArrays& position_mm, SeenVertices& seen);

// Linear functions over the ideal plane around corner a: barycentrics of b and c (screen space).
struct TrianglePlane {
    float ax, ay;
    float bx, by;
    float cx, cy;
    float iz, iz_b, iz_c;          // inverse depth at a, and its change towards b and c
    float light, light_b, light_c;
};

inline constexpr std::uint32_t kNothing = 0xFFFFFFFFU;

struct SeenSurface {
    std::vector<float> inverse_depth;     // per pixel, 0 where nothing is
    std::vector<std::uint32_t> plane;     // per pixel, index into planes or kNothing
    std::vector<TrianglePlane> planes;    // front-facing triangles that reach the image
    std::vector<std::uint32_t> triangle;  // of each plane
    int first_column = 0, end_column = 0, first_row = 0, end_row = 0;  // bounds of everything drawn
};

void rasterise(const PixelRays& rays, std::span<const Int3> triangles, const SeenVertices& seen,
               SeenSurface& surface);

}  // namespace rig::host
