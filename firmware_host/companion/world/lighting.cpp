#include "firmware_host/companion/world/lighting.hpp"

#include <algorithm>
#include <cmath>

#include "firmware_host/companion/world/wide_loops.hpp"

namespace rig::host {

namespace {

constexpr double kReference_mm = 180.0;
constexpr float kDeepest = 0.10F;  // a nostril still gets some light from its own walls

// A lamp in the face's frame.
struct PlacedLamp {
    float x, y, z;
    float power;  // at 1 mm
    float wrap;
};

struct Skin {
    const float *x, *y, *z;
    const float *normal_x, *normal_y, *normal_z;
    const float *albedo, *gloss;
    std::size_t count;
};

// Diffuse light with a soft terminator, and a glint (Blinn, power 24).
RIG_WIDE_LOOPS void add_lamp(const PlacedLamp& lamp, const std::array<float, 3>& eye, const Skin& skin,
                             float* __restrict__ light) {
    const float wrap_scale = 1.0F / (1.0F + lamp.wrap);
    for (std::size_t v = 0; v < skin.count; ++v) {
        const float dx = lamp.x - skin.x[v], dy = lamp.y - skin.y[v], dz = lamp.z - skin.z[v];
        const float vx = eye[0] - skin.x[v], vy = eye[1] - skin.y[v], vz = eye[2] - skin.z[v];
        const float nx = skin.normal_x[v], ny = skin.normal_y[v], nz = skin.normal_z[v];
        const float inverse = 1.0F / std::sqrt(dx * dx + dy * dy + dz * dz + 1.0F);
        const float view_inverse = 1.0F / std::sqrt(vx * vx + vy * vy + vz * vz + 1.0F);
        const float facing = ((nx * dx + ny * dy + nz * dz) * inverse + lamp.wrap) * wrap_scale;
        const float hx = dx * inverse + vx * view_inverse;
        const float hy = dy * inverse + vy * view_inverse;
        const float hz = dz * inverse + vz * view_inverse;
        const float along = nx * hx + ny * hy + nz * hz;
        // |h|^2 and (n h)^2 give the cosine's square without another root.
        const float h2 = (along > 0.0F ? along * along : 0.0F) / (hx * hx + hy * hy + hz * hz + 1e-6F);
        const float h4 = h2 * h2, h8 = h4 * h4, h16 = h8 * h8;
        const float diffuse = facing > 0.0F ? facing : 0.0F;
        light[v] +=
            lamp.power * inverse * inverse * (skin.albedo[v] + 0.35F * skin.gloss[v] * h16 * h8) * diffuse;
    }
}

}  // namespace

Lighting lighting_for(DotStyle style, const std::vector<HelmetCamera>& cameras) {
    Lighting lighting;
    if (style == DotStyle::kInk) {
        lighting.lamps = {{{-95.0, 45.0, 185.0}, 118.0, 0.35},
                          {{95.0, 45.0, 185.0}, 108.0, 0.35},
                          {{-85.0, -120.0, 180.0}, 100.0, 0.35},
                          {{85.0, -120.0, 180.0}, 110.0, 0.35}};
        lighting.ambient = 20.0;
        lighting.background = 7.0;
        return lighting;
    }
    for (const HelmetCamera& camera : cameras) {
        lighting.lamps.push_back({camera.centre_mm, 190.0 / static_cast<double>(cameras.size()), 0.05});
    }
    lighting.ambient = 7.0;
    lighting.background = 3.0;
    return lighting;
}

void light_vertices(const Lighting& lighting, const HelmetCamera& camera, const FaceView& view,
                    const PaintedFace& face, const PosedFace& posed, SeenVertices& seen) {
    const std::size_t count = face.vertex_count();
    // Into the face's own frame, where positions and normals are: X_face = R^T (X_cam - offset).
    const Mat3d back = transposed(view.rotation);
    const auto to_face = [&](const Vec3d& headset_mm) {
        return multiply(back, multiply(camera.rotation, headset_mm - camera.centre_mm) - view.offset_mm);
    };
    const Vec3d eye_mm = to_face(camera.centre_mm);
    const std::array<float, 3> eye = {static_cast<float>(eye_mm[0]), static_cast<float>(eye_mm[1]),
                                      static_cast<float>(eye_mm[2])};
    const Skin skin{posed.position_mm.x.data(), posed.position_mm.y.data(), posed.position_mm.z.data(),
                    posed.normal.x.data(),      posed.normal.y.data(),      posed.normal.z.data(),
                    face.albedo().data(),       face.gloss().data(),        count};
    const float* albedo = face.albedo().data();
    const float* open = face.openness().data();
    float* __restrict__ light = seen.light.data();
    const auto ambient = static_cast<float>(lighting.ambient);
    for (std::size_t v = 0; v < count; ++v) light[v] = ambient * albedo[v];
    for (const Lamp& lamp : lighting.lamps) {
        const Vec3d place = to_face(lamp.position_mm);
        add_lamp(
            {static_cast<float>(place[0]), static_cast<float>(place[1]), static_cast<float>(place[2]),
             static_cast<float>(lamp.power * kReference_mm * kReference_mm), static_cast<float>(lamp.wrap)},
            eye, skin, light);
    }
    for (std::size_t v = 0; v < count; ++v) light[v] *= kDeepest + (1.0F - kDeepest) * open[v];
}

}  // namespace rig::host
