#include "tests/support/dot_scene/dot_scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/support/dot_scene/light_field.hpp"
#include "tests/support/random.hpp"

namespace rig::test {

namespace {

constexpr int kSamples = 5;  // per pixel and axis

// Multiplies the pixels near (cx, cy) by a factor, as far as inside(dx, dy) covers them.
template <class Inside>
void paint(LightField& field, double cx, double cy, double reach, double factor, Inside inside) {
    const int x0 = std::max(0, static_cast<int>(cx - reach - 1.0));
    const int x1 = std::min(field.width - 1, static_cast<int>(cx + reach + 2.0));
    const int y0 = std::max(0, static_cast<int>(cy - reach - 1.0));
    const int y1 = std::min(field.height - 1, static_cast<int>(cy + reach + 2.0));
    for (int y = y0; y <= y1; ++y) {
        for (int x = x0; x <= x1; ++x) {
            int hits = 0;
            for (int j = 0; j < kSamples; ++j) {
                for (int i = 0; i < kSamples; ++i) {
                    hits += inside(x + (i + 0.5) / kSamples - 0.5 - cx, y + (j + 0.5) / kSamples - 0.5 - cy)
                                ? 1
                                : 0;
                }
            }
            const double cover = static_cast<double>(hits) / (kSamples * kSamples);
            field.at(x, y) *= 1.0 + cover * (factor - 1.0);
        }
    }
}

void paint_ellipse(LightField& field, double x, double y, double long_px, double short_px, double angle,
                   double factor) {
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    const double a = 0.5 * long_px;
    const double b = 0.5 * short_px;
    paint(field, x, y, a, factor, [=](double dx, double dy) {
        const double u = (c * dx + s * dy) / a;
        const double v = (c * dy - s * dx) / b;
        return u * u + v * v <= 1.0;
    });
}

// A chain of small discs along a bent line; every disc is drawn to its own part so that overlaps do not
// multiply.
void paint_stroke(LightField& field, SeededRandom& random, double length, double width, double factor) {
    const double x0 = random.uniform(20.0, field.width - 20.0);
    const double y0 = random.uniform(20.0, field.height - 20.0);
    const double angle = random.uniform(0.0, 2.0 * std::numbers::pi);
    const double bend = random.uniform(-0.02, 0.02);
    paint(field, x0, y0, length, factor, [=](double dx, double dy) {
        const double u = std::cos(angle) * dx + std::sin(angle) * dy;
        const double v = std::cos(angle) * dy - std::sin(angle) * dx - bend * u * u;
        const double half = 0.5 * width * (1.0 - 0.6 * std::abs(u) / (0.5 * length));  // tapers off
        return std::abs(u) <= 0.5 * length && std::abs(v) <= half;
    });
}

void add_clutter(LightField& albedo, const Scene& scene, SeededRandom& random) {
    double dot = 10.0;
    for (const SceneDot& d : scene.dots) dot = std::max(dot, d.long_px);
    for (int i = 0; i < scene.clutter.shadows; ++i) {
        LightField shade(albedo.width, albedo.height, 1.0);
        const double size = random.uniform(1.5, 5.0) * dot;
        paint_ellipse(shade, random.uniform(0.0, albedo.width), random.uniform(0.0, albedo.height),
                      2.0 * size, size, random.uniform(0.0, 3.0), random.uniform(0.4, 0.8));
        blur(shade, 0.3 * dot + 2.0);
        for (std::size_t k = 0; k < albedo.values.size(); ++k) albedo.values[k] *= shade.values[k];
    }
    for (int i = 0; i < scene.clutter.lines; ++i) {
        paint_stroke(albedo, random, random.uniform(30.0, 120.0), random.uniform(1.5, 4.0),
                     random.uniform(0.3, 0.7));
    }
    for (int i = 0; i < scene.clutter.hairs; ++i) {
        paint_stroke(albedo, random, random.uniform(20.0, 60.0), random.uniform(0.7, 1.6),
                     random.uniform(0.2, 0.6));
    }
    for (int i = 0; i < scene.clutter.patches; ++i) {
        const double size = random.uniform(3.0, 5.0) * dot;
        const double factor = random.chance(0.5) ? random.uniform(0.1, 0.5) : random.uniform(1.4, 2.0);
        paint_ellipse(albedo, random.uniform(30.0, albedo.width - 30.0),
                      random.uniform(30.0, albedo.height - 30.0), size, random.uniform(0.4, 1.0) * size,
                      random.uniform(0.0, 3.0), factor);
    }
}

// Paint on paint is paint: where dots overlap the stronger one counts, they do not multiply.
void add_dots(LightField& albedo, const Scene& scene, SeededRandom& random) {
    LightField layer(albedo.width, albedo.height, 1.0);
    for (const SceneDot& dot : scene.dots) {
        const double reach = 0.5 * dot.long_px + 2.0;
        const int x0 = static_cast<int>(dot.x_px - reach);
        const int y0 = static_cast<int>(dot.y_px - reach);
        const int side = static_cast<int>(2.0 * reach) + 2;
        LightField one(side, side, 1.0);
        paint_ellipse(one, dot.x_px - x0, dot.y_px - y0, dot.long_px, dot.short_px, dot.angle_rad, dot.paint);
        if (dot.glint) {
            const double play = 0.2 * dot.short_px;
            paint_ellipse(one, dot.x_px - x0 + random.uniform(-play, play),
                          dot.y_px - y0 + random.uniform(-play, play), 0.25 * dot.short_px,
                          0.2 * dot.short_px, 0.3, 1.0 / dot.paint);
        }
        for (int y = 0; y < side; ++y) {
            for (int x = 0; x < side; ++x) {
                const int px = x + x0;
                const int py = y + y0;
                if (px < 0 || py < 0 || px >= albedo.width || py >= albedo.height) continue;
                double& value = layer.at(px, py);
                value = dot.paint < 1.0 ? std::min(value, one.at(x, y)) : std::max(value, one.at(x, y));
            }
        }
    }
    for (std::size_t k = 0; k < albedo.values.size(); ++k) albedo.values[k] *= layer.values[k];
}

void add_light(LightField& albedo, const Scene& scene, SeededRandom& random) {
    const SceneLight& light = scene.light;
    LightField texture(albedo.width, albedo.height, 0.0);
    for (double& value : texture.values) value = random.normal(0.0, 1.0);
    blur(texture, 5.0);
    double square = 0.0;
    for (const double value : texture.values) square += value * value;
    const double scale = light.texture / std::sqrt(square / static_cast<double>(texture.values.size()));
    const double direction = random.uniform(0.0, 2.0 * std::numbers::pi);
    for (int y = 0; y < albedo.height; ++y) {
        for (int x = 0; x < albedo.width; ++x) {
            const double u = (x - 0.5 * albedo.width) / (0.5 * albedo.width);
            const double v = (y - 0.5 * albedo.height) / (0.5 * albedo.height);
            const double slope = 1.0 + 0.5 * light.gradient *
                                           (std::cos(direction) * u + std::sin(direction) * v) /
                                           std::numbers::sqrt2;
            const double edge = 1.0 - 0.5 * light.vignetting * (u * u + v * v);
            albedo.at(x, y) *= light.skin * slope * edge * (1.0 + scale * texture.at(x, y));
            if (scene.clutter.silhouette && u > 0.72 + 0.1 * v * v) albedo.at(x, y) = 6.0;
        }
    }
}

}  // namespace

Picture render(const Scene& scene) {
    SeededRandom random(scene.seed);
    LightField field(scene.width_px, scene.height_px, 1.0);
    add_clutter(field, scene, random);
    add_dots(field, scene, random);
    add_light(field, scene, random);
    blur(field, scene.light.blur_px);
    return digitise(field, scene.light.read_noise, scene.light.shot_noise, random);
}

Scene lattice_scene(double diameter_px, double max_aspect, bool bright, std::uint64_t seed) {
    SeededRandom random(seed);
    Scene scene;
    scene.seed = seed;
    scene.light.skin = bright ? 45.0 : random.uniform(70.0, 150.0);
    const double pitch = std::max(3.0 * diameter_px, 30.0);  // at most 165 dots: below the capacity
    for (double y = pitch; y < scene.height_px - 0.75 * pitch; y += pitch) {
        for (double x = pitch; x < scene.width_px - 0.75 * pitch; x += pitch) {
            SceneDot dot;
            dot.x_px = x + random.uniform(-0.2, 0.2) * pitch;
            dot.y_px = y + random.uniform(-0.2, 0.2) * pitch;
            dot.long_px = diameter_px * random.uniform(0.9, 1.1);
            dot.short_px = dot.long_px / random.uniform(1.0, max_aspect);
            dot.angle_rad = random.uniform(0.0, std::numbers::pi);
            dot.paint = bright ? random.uniform(2.5, 4.5) : random.uniform(0.15, 0.25);
            scene.dots.push_back(dot);
        }
    }
    return scene;
}

Scene single_dot_scene(int side_px, double skin, const SceneDot& dot) {
    Scene scene;
    scene.width_px = side_px;
    scene.height_px = side_px;
    scene.light = {.skin = skin,
                   .gradient = 0.0,
                   .vignetting = 0.0,
                   .texture = 0.0,
                   .blur_px = 0.8,
                   .read_noise = 0.0,
                   .shot_noise = 0.0};
    scene.dots.push_back(dot);
    return scene;
}

Scene touching_scene(double diameter_px, bool bright, std::uint64_t seed) {
    Scene scene = lattice_scene(diameter_px, 1.2, bright, seed);
    SeededRandom random(seed + 1);
    std::vector<SceneDot> partners;
    for (SceneDot& dot : scene.dots) {
        if (!random.chance(0.4)) continue;
        SceneDot partner = dot;
        const double distance = dot.long_px * random.uniform(0.85, 1.15);
        const double angle = random.uniform(0.0, 2.0 * std::numbers::pi);
        partner.x_px += distance * std::cos(angle);
        partner.y_px += distance * std::sin(angle);
        partner.short_px = partner.long_px;
        dot.short_px = dot.long_px;
        partners.push_back(partner);
    }
    scene.dots.insert(scene.dots.end(), partners.begin(), partners.end());
    return scene;
}

Picture inverted(const Picture& picture) {
    Picture result = picture;
    for (std::uint8_t& value : result.pixels) value = static_cast<std::uint8_t>(255 - value);
    return result;
}

Picture shifted(const Picture& picture, int dx_px, int dy_px) {
    Picture result = picture;
    for (int y = 0; y < picture.height_px; ++y) {
        for (int x = 0; x < picture.width_px; ++x) {
            const auto sx = static_cast<std::size_t>(std::clamp(x - dx_px, 0, picture.width_px - 1));
            const auto sy = static_cast<std::size_t>(std::clamp(y - dy_px, 0, picture.height_px - 1));
            const auto width = static_cast<std::size_t>(picture.width_px);
            result.pixels[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)] =
                picture.pixels[sy * width + sx];
        }
    }
    return result;
}

}  // namespace rig::test
