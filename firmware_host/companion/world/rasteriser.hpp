// Which triangle each pixel of a distorted camera sees: a z-buffer whose inside test runs in undistorted
// coordinates, so that lens distortion is exact at every pixel and not only at vertices.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "firmware_host/companion/rig_folder/rig_folder.hpp"
#include "firmware_host/companion/world/helmet.hpp"
#include "firmware_host/companion/world/painted_face.hpp"

namespace rig::host {

inline constexpr std::uint32_t kNothing = 0xFFFFFFFFU;
inline constexpr int kWide = 4;

// Four pixels of a row, in one cache line. x, y: the pixel's ray on the undistorted image plane, in pixels
// from the optical axis ("ideal px": f X / Z, f Y / Z); NaN where the lens formula does not reach, which sees
// nothing.
struct alignas(64) PixelGroup {
    std::array<float, kWide> x, y;
    std::array<float, kWide> inverse_depth;  // 1/mm, 0 where nothing is
    std::array<std::uint32_t, kWide> plane;  // index into SeenSurface::planes, or kNothing
};
static_assert(sizeof(PixelGroup) == 64);

struct IdealPoint {
    float x, y;
};

// Every pixel of one camera.
class PixelGrid {
  public:
    explicit PixelGrid(const HelmetCamera& camera);
    // Forgets what was drawn; costs no more than what was drawn since the last time.
    void clear();
    // Widens what clear() covers.
    void note_drawn(int first_column, int end_column, int first_row, int end_row);
    [[nodiscard]] int width_px() const { return width_px_; }
    [[nodiscard]] int height_px() const { return height_px_; }
    // Groups of a row; the last may reach beyond the image, where rays are NaN.
    [[nodiscard]] PixelGroup* row(int y) { return groups_.data() + static_cast<std::size_t>(y) * stride_; }
    [[nodiscard]] const PixelGroup* row(int y) const {
        return groups_.data() + static_cast<std::size_t>(y) * stride_;
    }
    [[nodiscard]] IdealPoint ray(int x, int y) const {
        const PixelGroup& group = row(y)[x / kWide];
        const auto lane = static_cast<std::size_t>(x % kWide);
        return {group.x[lane], group.y[lane]};
    }
    [[nodiscard]] std::uint32_t plane(int x, int y) const {
        return row(y)[x / kWide].plane[static_cast<std::size_t>(x % kWide)];
    }

  private:
    int width_px_;
    int height_px_;
    std::size_t stride_;
    std::vector<PixelGroup> groups_;
    int first_column_ = 0, end_column_ = 0, first_row_ = 0, end_row_ = 0;
};

// X_cam = rotation X_face + offset_mm: slip and camera in one.
struct FaceView {
    Mat3d rotation = kIdentity3;
    Vec3d offset_mm{};
};

// Vertices as one camera sees them.
struct SeenVertices {
    std::vector<float> x, y;           // ideal px
    std::vector<float> inverse_depth;  // 1/mm; 0 behind the camera
    std::vector<float> column, row;    // distorted px, for bounds only
    std::vector<float> light;          // radiance, DN at nominal exposure
};

void project(const HelmetCamera& camera, const FaceView& view, const VertexArrays& position_mm,
             SeenVertices& seen);

// Linear functions over the ideal plane around corner a: barycentrics of b and c (screen space).
struct TrianglePlane {
    float ax, ay;
    float bx, by;
    float cx, cy;
    float iz, iz_b, iz_c;  // inverse depth at a, and its change towards b and c
    float light, light_b, light_c;
};

struct SeenSurface {
    std::vector<TrianglePlane> planes;    // front-facing triangles that reach the image
    std::vector<std::uint32_t> triangle;  // of each plane
    int first_column = 0, end_column = 0, first_row = 0, end_row = 0;  // bounds of everything drawn
    std::vector<float> cover;  // per tile, once the first triangles are drawn: the least inverse depth in it
};

// The first `front_count` triangles are drawn outright; of the others those that lie wholly behind what is
// already there are skipped before they cost anything.
void rasterise(std::span<const Int3> triangles, std::size_t front_count, const SeenVertices& seen,
               PixelGrid& grid, SeenSurface& surface);

}  // namespace rig::host
