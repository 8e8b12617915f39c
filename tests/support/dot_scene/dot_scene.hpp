// Pictures of painted dots whose truth is known: discs in perspective on shaded, textured skin, with the
// things that are no dots. Written from the optics, not from the detector, so that it can contradict it. Not
// a face.
#pragma once

#include <cstdint>
#include <vector>

#include "core/image/view.hpp"

namespace rig::test {

struct SceneDot {
    double x_px = 0.0;  // centre of area; integers are pixel centres
    double y_px = 0.0;
    double long_px = 10.0;  // diameters
    double short_px = 10.0;
    double angle_rad = 0.0;
    double paint = 0.18;  // reflectance relative to skin: below 1 dark, above bright
    bool glint = false;   // a specular highlight of skin's brightness lies on it
};

struct SceneLight {
    double skin = 110.0;       // grey level of unshaded skin
    double gradient = 0.5;     // change of light across the picture, relative
    double vignetting = 0.3;   // loss of light at the corners
    double texture = 0.06;     // relative standard deviation of the skin's smooth mottling
    double blur_px = 0.8;      // Gaussian sigma of the lens
    double read_noise = 1.5;   // grey levels
    double shot_noise = 0.25;  // variance per grey level
};

// What a face has besides dots.
struct SceneClutter {
    int lines = 0;    // lids, lips, wrinkles: dark arcs 1.5 to 4 px wide
    int hairs = 0;    // bundles of thin strands
    int patches = 0;  // eyes, nostrils, teeth: sharp ellipses three times a dot and more, dark or bright
    int shadows = 0;  // soft, without an edge
    bool silhouette = false;  // the right part is far behind, black
};

struct Scene {
    int width_px = 480;
    int height_px = 360;
    std::vector<SceneDot> dots;
    SceneLight light;
    SceneClutter clutter;
    std::uint64_t seed = 1;
};

struct Picture {
    int width_px = 0;
    int height_px = 0;
    std::vector<std::uint8_t> pixels;
    [[nodiscard]] ImageView view() const {
        return {
            .pixels = pixels.data(), .width_px = width_px, .height_px = height_px, .stride_bytes = width_px};
    }
};

[[nodiscard]] Picture render(const Scene& scene);

// Dots of one make on a jittered lattice, turned away by up to 1 / `max_aspect`, none at the border.
[[nodiscard]] Scene lattice_scene(double diameter_px, double max_aspect, bool bright, std::uint64_t seed);

// One dot on even skin, blurred by the lens, without noise.
[[nodiscard]] Scene single_dot_scene(int side_px, double skin, const SceneDot& dot);

// Pairs of dots whose outlines touch or nearly do, among single ones.
[[nodiscard]] Scene touching_scene(double diameter_px, bool bright, std::uint64_t seed);

[[nodiscard]] Picture inverted(const Picture& picture);
[[nodiscard]] Picture shifted(const Picture& picture, int dx_px, int dy_px);  // new pixels repeat the border

}  // namespace rig::test
