// Light on skin: the even light of a helmet's side panels, or the ring light around each lens.
#pragma once

#include <vector>

#include "firmware_host/companion/world/painted_face.hpp"
#include "firmware_host/companion/world/rasteriser.hpp"

namespace rig::host {

enum class DotStyle : std::uint8_t {
    kInk,    // dark dots under even light
    kRetro,  // retro-reflective bright dots under a ring light around each lens
};

struct Lamp {
    Vec3d position_mm{};  // headset frame
    double power = 0.0;   // DN of a white surface that faces it from 180 mm, at nominal exposure
    double wrap = 0.0;    // 0 a point, 0.5 a wide panel
};

struct Lighting {
    std::vector<Lamp> lamps;
    double ambient = 0.0;     // DN of a white surface
    double background = 0.0;  // DN of the room behind the head
};

[[nodiscard]] Lighting lighting_for(DotStyle style, const std::vector<HelmetCamera>& cameras);

// Radiance of every vertex towards the camera, into seen.light.
void light_vertices(const Lighting& lighting, const HelmetCamera& camera, const FaceView& view,
                    const PaintedFace& face, const PosedFace& posed, SeenVertices& seen);

}  // namespace rig::host
