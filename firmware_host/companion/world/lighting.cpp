#include "firmware_host/companion/world/lighting.hpp"

#include <algorithm>
#include <cmath>

namespace rig::host {

namespace {

constexpr double kReference_mm = 180.0;
constexpr float kDeepest = 0.10F;  // a nostril still gets some light from its own walls

}  // namespace

Lighting lighting_for(DotStyle style, const std::vector<HelmetCamera>& cameras) {
    Lighting lighting;
    if (style == DotStyle::kInk) {
        lighting.lamps = {{{-95.0, 45.0, 185.0}, 72.0, 0.35},
                          {{95.0, 45.0, 185.0}, 66.0, 0.35},
                          {{-85.0, -120.0, 180.0}, 62.0, 0.35},
                          {{85.0, -120.0, 180.0}, 68.0, 0.35}};
        lighting.ambient = 14.0;
        lighting.background = 7.0;
        return lighting;
    }
    for (const HelmetCamera& camera : cameras) {
        lighting.lamps.push_back({camera.centre_mm, 130.0 / static_cast<double>(cameras.size()), 0.05});
    }
    lighting.ambient = 5.0;
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
    const Vec3d eye = to_face(camera.centre_mm);
    const auto ex = static_cast<float>(eye[0]), ey = static_cast<float>(eye[1]), ez = static_cast<float>(eye[2]);
    const float* px = posed.position_mm.x.data();
    const float* py = posed.position_mm.y.data();
    const float* pz = posed.position_mm.z.data();
    const float* nx = posed.normal.x.data();
    const float* ny = posed.normal.y.data();
    const float* nz = posed.normal.z.data();
    const float* albedo = face.albedo().data();
    const float* gloss = face.gloss().data();
    const float* open = face.openness().data();
    float* __restrict__ light = seen.light.data();
    const auto ambient = static_cast<float>(lighting.ambient);
    for (std::size_t v = 0; v < count; ++v) light[v] = ambient * albedo[v];
    for (const Lamp& lamp : lighting.lamps) {
        const Vec3d place = to_face(lamp.position_mm);
        const auto lx = static_cast<float>(place[0]), ly = static_cast<float>(place[1]), lz = static_cast<float>(place[2]);
        const auto power = static_cast<float>(lamp.power * kReference_mm * kReference_mm);
        const auto wrap = static_cast<float>(lamp.wrap);
        const float wrap_scale = 1.0F / (1.0F + wrap);
        for (std::size_t v = 0; v < count; ++v) {
            const float dx = lx - px[v], dy = ly - py[v], dz = lz - pz[v];
            const float square = dx * dx + dy * dy + dz * dz + 1.0F;
            const float inverse = 1.0F / std::sqrt(square);
            const float facing = ((nx[v] * dx + ny[v] * dy + nz[v] * dz) * inverse + wrap) * wrap_scale;
            const float vx = ex - px[v], vy = ey - py[v], vz = ez - pz[v];
            const float view_inverse = 1.0F / std::sqrt(vx * vx + vy * vy + vz * vz + 1.0F);
            const float hx = dx * inverse + vx * view_inverse;
            const float hy = dy * inverse + vy * view_inverse;
            const float hz = dz * inverse + vz * view_inverse;
            const float half = (nx[v] * hx + ny[v] * hy + nz[v] * hz) / std::sqrt(hx * hx + hy * hy + hz * hz + 1e-6F);
            const float h2 = half > 0.0F ? half * half : 0.0F;
            const float h4 = h2 * h2, h8 = h4 * h4, h16 = h8 * h8;
            const float glint = gloss[v] * 0.35F * h16 * h8;
            const float diffuse = facing > 0.0F ? facing : 0.0F;
            light[v] += power * inverse * inverse * (albedo[v] + glint) * diffuse;
        }
    }
    for (std::size_t v = 0; v < count; ++v) light[v] *= kDeepest + (1.0F - kDeepest) * open[v];
}

}  // namespace rig::host
