#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "firmware_host/companion/world/world.hpp"

namespace rig::host {

namespace {

constexpr float kInk = 0.13F;        // of the light that bare skin there would send back
constexpr float kRetro_dn = 205.0F;  // of a reflector that faces the camera from 200 mm
constexpr double kRetroReference_mm = 200.0;
constexpr double kHiddenBy_mm = 0.6;  // a surface this far in front of a marker hides it
constexpr float kRimBand_mm = 1.5F;   // farther from a rim than this, a pixel is all paint or all skin
constexpr std::size_t kNoFrame = std::numeric_limits<std::size_t>::max();

struct Rest {
    float x, y, z;
};

// Point of the neutral face under an ideal-plane position, on the plane of one triangle.
Rest rest_at(const PaintedFace& face, const Int3& corner, const TrianglePlane& plane, float x, float y) {
    const float dx = x - plane.ax, dy = y - plane.ay;
    const float b = (plane.bx * dx + plane.by * dy) * (plane.iz + plane.iz_b);
    const float c = (plane.cx * dx + plane.cy * dy) * (plane.iz + plane.iz_c);
    const float a = (1.0F - (plane.bx * dx + plane.by * dy) - (plane.cx * dx + plane.cy * dy)) * plane.iz;
    const float scale = 1.0F / (a + b + c);
    const auto mix = [&](const std::vector<float>& values) {
        return scale * (a * values[static_cast<std::size_t>(corner[0])] +
                        b * values[static_cast<std::size_t>(corner[1])] +
                        c * values[static_cast<std::size_t>(corner[2])]);
    };
    const VertexArrays& rest = face.rest_mm();
    return {mix(rest.x), mix(rest.y), mix(rest.z)};
}

Rest operator-(const Rest& a, const Rest& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}

float dot(const Rest& a, const Rest& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

float length(const Rest& a) {
    return std::sqrt(dot(a, a));
}

Rest centre_of(const Dot& painted) {
    return {static_cast<float>(painted.rest_mm[0]), static_cast<float>(painted.rest_mm[1]),
            static_cast<float>(painted.rest_mm[2])};
}

// How far the point of the neutral face moves from one pixel to the next, in either direction of the image.
struct RestPerPixel {
    Rest x, y;
};

RestPerPixel change_at(const PaintedFace& face, const Int3& corner, const TrianglePlane& plane,
                       const PixelGrid& grid, int column, int row) {
    const IdealPoint here = grid.ray(column, row);
    const auto across = [&](const IdealPoint& neighbour) {
        const float dx = 0.5F * (neighbour.x - here.x), dy = 0.5F * (neighbour.y - here.y);
        return rest_at(face, corner, plane, here.x + dx, here.y + dy) -
               rest_at(face, corner, plane, here.x - dx, here.y - dy);
    };
    // Towards the middle of the image, so that the neighbour exists; the sign of a change does not matter.
    const int beside = column + 1 < grid.width_px() ? column + 1 : column - 1;
    const int below = row + 1 < grid.height_px() ? row + 1 : row - 1;
    return {across(grid.ray(beside, row)), across(grid.ray(column, below))};
}

// Sheeting sends light back up to about 60 degrees of entrance, and fades smoothly beyond.
double retro_fade(double cosine) {
    const double t = std::clamp((cosine - 0.05) / 0.75, 0.0, 1.0);
    return 0.30 + 0.70 * t * t * (3.0 - 2.0 * t);
}

}  // namespace

WorldRenderer::WorldRenderer(const World& world)
    : world_(world),
      lighting_(lighting_for(world.config().style, world.cameras())),
      posed_frame_(kNoFrame),
      dots_(world.marker_count()),
      cos_view_(world.marker_count()) {
    for (const HelmetCamera& camera : world.cameras()) {
        grids_.emplace_back(camera);
        sensors_.emplace_back(camera, world.config().defocus_px, world.config().vignetting,
                              world.config().noise);
    }
    radiance_.values.resize(world.image_bytes());
    radiance_.background = static_cast<float>(lighting_.background);
}

void WorldRenderer::pose(std::size_t frame) {
    if (frame == posed_frame_) return;
    truth_ = world_.truth(frame);
    world_.face().pose(truth_.weights, posed_);
    posed_frame_ = frame;
}

void WorldRenderer::render(std::size_t frame, std::size_t camera, const CameraControl& control,
                           std::span<std::uint8_t> image, std::span<MarkerSight> sights) {
    pose(frame);
    const HelmetCamera& eye = world_.cameras()[camera];
    view_ = world_.view(frame, camera);
    project(eye, view_, posed_.position_mm, seen_);
    light_vertices(lighting_, eye, view_, world_.face(), posed_, seen_);
    rasterise(world_.face().triangles(), world_.face().skin_triangle_count(), seen_, grids_[camera],
              surface_);
    prepare_dots();
    shade(grids_[camera]);
    sensors_[camera].expose(radiance_, control, world_.config().seed, frame, camera, image);
    if (!sights.empty()) report(camera, sights);
}

void WorldRenderer::prepare_dots() {
    for (std::size_t m = 0; m < dots_.size(); ++m) {
        const Dot& dot_here = world_.face().dots()[m];
        Vec3d normal{};
        for (std::size_t k = 0; k < 3; ++k) {
            const auto v = static_cast<std::size_t>(dot_here.vertices[k]);
            const auto share = static_cast<double>(dot_here.barycentric[k]);
            normal = normal + share * Vec3d{static_cast<double>(posed_.normal.x[v]),
                                            static_cast<double>(posed_.normal.y[v]),
                                            static_cast<double>(posed_.normal.z[v])};
        }
        const Vec3d seen_mm = multiply(view_.rotation, truth_.face_mm[m]) + view_.offset_mm;
        const double distance = length(seen_mm);
        cos_view_[m] = -dot(normalised(multiply(view_.rotation, normal)), normalised(seen_mm));
        const double nearness = kRetroReference_mm / std::max(distance, 1.0);
        dots_[m] = {};
        dots_[m].retro_dn = static_cast<float>(static_cast<double>(kRetro_dn) * retro_fade(cos_view_[m]) *
                                               nearness * nearness);
    }
}

void WorldRenderer::shade(const PixelGrid& grid) {
    std::fill(radiance_.values.begin(), radiance_.values.end(), radiance_.background);
    radiance_.first_column = surface_.first_column;
    radiance_.end_column = surface_.end_column;
    radiance_.first_row = surface_.first_row;
    radiance_.end_row = surface_.end_row;
    const PaintedFace& face = world_.face();
    for (int row = surface_.first_row; row < surface_.end_row; ++row) {
        float* out = radiance_.values.data() +
                     static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.width_px());
        for (int column = surface_.first_column; column < surface_.end_column; ++column) {
            const std::uint32_t index = grid.plane(column, row);
            if (index == kNothing) continue;
            const TrianglePlane& plane = surface_.planes[index];
            const IdealPoint ray = grid.ray(column, row);
            const float dx = ray.x - plane.ax, dy = ray.y - plane.ay;
            const float skin_dn = plane.light + plane.light_b * (plane.bx * dx + plane.by * dy) +
                                  plane.light_c * (plane.cx * dx + plane.cy * dy);
            const std::uint32_t triangle = surface_.triangle[index];
            out[column] = face.dots_of(triangle).empty() ? skin_dn : paint(grid, column, row, index, skin_dn);
        }
    }
}

// Coverage of the pixel by paint: distance to the dot's rim, measured on the neutral skin, over its change
// per pixel.
float WorldRenderer::paint(const PixelGrid& grid, int column, int row, std::uint32_t index, float skin_dn) {
    const PaintedFace& face = world_.face();
    const TrianglePlane& plane = surface_.planes[index];
    const std::uint32_t triangle = surface_.triangle[index];
    const IdealPoint ray = grid.ray(column, row);
    const Int3& corner = face.triangles()[triangle];
    const auto radius = static_cast<float>(face.dot_radius_mm());
    const Rest here = rest_at(face, corner, plane, ray.x, ray.y);
    std::optional<RestPerPixel> change;
    float value = skin_dn;
    for (const std::uint16_t m : face.dots_of(triangle)) {
        const Rest from = here - centre_of(face.dots()[m]);
        const float d = length(from);
        if (d > radius + kRimBand_mm) continue;
        float cover = 1.0F;
        if (d > radius - kRimBand_mm && d > 0.3F * radius) {
            if (!change) change = change_at(face, corner, plane, grid, column, row);
            const float gx = dot(from, change->x), gy = dot(from, change->y);
            cover = std::clamp(0.5F + (radius - d) * d / (std::sqrt(gx * gx + gy * gy) + 1e-6F), 0.0F, 1.0F);
        }
        if (cover <= 0.0F) continue;
        const bool ink = world_.config().style == DotStyle::kInk;
        const float paint_dn = ink ? kInk * skin_dn : 0.5F * skin_dn + dots_[m].retro_dn;
        value += cover * (paint_dn - value);
        const auto share = static_cast<double>(cover);
        dots_[m].area += share;
        dots_[m].x += share * column;
        dots_[m].y += share * row;
    }
    return value;
}

bool WorldRenderer::unhidden(std::size_t marker, const PixelAt& at, std::size_t camera) const {
    const HelmetCamera& eye = world_.cameras()[camera];
    if (!(at.x_px > -0.5 && at.y_px > -0.5 && at.x_px < eye.width_px - 0.5 && at.y_px < eye.height_px - 0.5))
        return false;
    const std::uint32_t index =
        grids_[camera].plane(static_cast<int>(std::lround(at.x_px)), static_cast<int>(std::lround(at.y_px)));
    if (index == kNothing) return false;
    const auto listed = world_.face().dots_of(surface_.triangle[index]);
    if (std::find(listed.begin(), listed.end(), marker) != listed.end()) return true;
    const TrianglePlane& plane = surface_.planes[index];
    const RaySlope slope = slope_of_pixel(eye, at.x_px, at.y_px);
    const double dx = eye.f_px * slope.x - static_cast<double>(plane.ax);
    const double dy = eye.f_px * slope.y - static_cast<double>(plane.ay);
    const double inverse = static_cast<double>(plane.iz) +
                           static_cast<double>(plane.iz_b) *
                               (static_cast<double>(plane.bx) * dx + static_cast<double>(plane.by) * dy) +
                           static_cast<double>(plane.iz_c) *
                               (static_cast<double>(plane.cx) * dx + static_cast<double>(plane.cy) * dy);
    return inverse > 0.0 && 1.0 / inverse > at.depth_mm - kHiddenBy_mm;
}

void WorldRenderer::report(std::size_t camera, std::span<MarkerSight> sights) const {
    const HelmetCamera& eye = world_.cameras()[camera];
    for (std::size_t m = 0; m < dots_.size() && m < sights.size(); ++m) {
        const PixelAt at = see(eye, truth_.headset_mm[m]);
        MarkerSight& sight = sights[m];
        sight.x_px = at.x_px;
        sight.y_px = at.y_px;
        sight.dot_area_px = dots_[m].area;
        const double scale =
            dots_[m].area > 0.0 ? 1.0 / dots_[m].area : std::numeric_limits<double>::quiet_NaN();
        sight.dot_x_px = scale * dots_[m].x;
        sight.dot_y_px = scale * dots_[m].y;
        sight.cos_view = cos_view_[m];
        sight.visible =
            at.depth_mm > 0.0 && cos_view_[m] > 0.0 && dots_[m].area > 0.0 && unhidden(m, at, camera);
    }
}

}  // namespace rig::host
