#include "tests/support/dot_scene/disc_scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tests/support/dot_scene/disturbances.hpp"
#include "tests/support/dot_scene/light_field.hpp"
#include "tests/support/random.hpp"

namespace rig::test {

namespace {

constexpr double kInkPaint = 0.2;    // reflectance relative to skin
constexpr double kInkSkin = 160.0;   // grey level of skin that faces the light
constexpr double kRetroSkin = 45.0;  // retro-reflective discs are exposed for themselves
constexpr double kBehind = 6.0;      // grey level of what is behind the head
constexpr double kGoldenAngle = 2.399963229728653;
constexpr int kDiscsOnSphere = 270;  // over the whole sphere; a fifth of them faces the camera

struct Vector {
    double x = 0.0, y = 0.0, z = 0.0;
};
double dot(const Vector& a, const Vector& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
Vector unit(const Vector& a) {
    const double length = std::sqrt(dot(a, a));
    return {a.x / length, a.y / length, a.z / length};
}
Vector cross(const Vector& a, const Vector& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
// Rodrigues' formula.
Vector turned(const Vector& v, const double (&turn_rad)[3]) {
    const Vector turn{turn_rad[0], turn_rad[1], turn_rad[2]};
    const double angle = std::sqrt(dot(turn, turn));
    if (angle == 0.0) return v;
    const Vector axis = unit(turn);
    const Vector side = cross(axis, v);
    const double along = dot(axis, v) * (1.0 - std::cos(angle));
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    return {v.x * c + side.x * s + axis.x * along, v.y * c + side.y * s + axis.y * along,
            v.z * c + side.z * s + axis.z * along};
}

// Camera at the origin, looking along +z at a sphere.
class Head {
  public:
    Head(const DiscSceneConfig& config, SeededRandom& random)
        : c_(config),
          centre_{config.slip_mm[0], config.slip_mm[1],
                  config.slip_mm[2] + config.distance_mm + config.head_radius_mm} {
        const double angle = random.uniform(0.0, 2.0 * std::numbers::pi);
        const double tilt = random.uniform(0.35, 0.9);
        light_ = {std::cos(angle) * std::sin(tilt), std::sin(angle) * std::sin(tilt), -std::cos(tilt)};
        ambient_ = random.uniform(0.25, 0.5);
        level_ = skin_level(config) * random.uniform(0.8, 1.2);
    }

    // Outward normal where the ray through a pixel meets the head; false beside it.
    [[nodiscard]] bool hit(double x_px, double y_px, Vector& normal, double& cosine) const {
        const Vector ray = unit({(x_px - 0.5 * (c_.width_px - 1)) / c_.focal_px,
                                 (y_px - 0.5 * (c_.height_px - 1)) / c_.focal_px, 1.0});
        const double along = dot(ray, centre_);
        const double square = along * along - dot(centre_, centre_) + c_.head_radius_mm * c_.head_radius_mm;
        if (square <= 0.0) return false;
        const double t = along - std::sqrt(square);
        normal = {(t * ray.x - centre_.x) / c_.head_radius_mm, (t * ray.y - centre_.y) / c_.head_radius_mm,
                  (t * ray.z - centre_.z) / c_.head_radius_mm};
        cosine = -dot(normal, ray);
        return true;
    }

    [[nodiscard]] Vector point(const Vector& normal) const {
        const double r = c_.head_radius_mm;
        return {r * normal.x + centre_.x, r * normal.y + centre_.y, r * normal.z + centre_.z};
    }
    [[nodiscard]] double cosine_at(const Vector& normal) const { return -dot(normal, unit(point(normal))); }
    [[nodiscard]] double x_px(const Vector& p) const {
        return c_.focal_px * p.x / p.z + 0.5 * (c_.width_px - 1);
    }
    [[nodiscard]] double y_px(const Vector& p) const {
        return c_.focal_px * p.y / p.z + 0.5 * (c_.height_px - 1);
    }
    // Skin: ambient and one lamp, or, for retro-reflective discs, the ring of light at the lens.
    [[nodiscard]] double skin(const Vector& normal, double cosine) const {
        const double lit = c_.bright ? cosine : std::max(0.0, dot(normal, light_));
        return level_ * (ambient_ + (1.0 - ambient_) * lit);
    }

  private:
    const DiscSceneConfig& c_;
    Vector centre_;
    Vector light_;
    double ambient_ = 0.0;
    double level_ = 0.0;
};

struct Disc {
    Vector normal;
    double gain = 0.0;  // light relative to skin
};

// A Fibonacci lattice, turned and jittered: neighbours are three diameters and more apart.
// The same ones, in the same order, wherever the head slips to.
std::vector<Disc> place_discs(const DiscSceneConfig& config, const Head& rest, SeededRandom& random) {
    std::vector<Disc> discs;
    const double turn = random.uniform(0.0, 2.0 * std::numbers::pi);
    const double spread = 75.0 / config.head_radius_mm;
    const auto count = static_cast<int>(kDiscsOnSphere / (spread * spread));
    for (int i = 0; i < count; ++i) {
        const double z = -1.0 + 2.0 * (i + 0.5) / count + random.uniform(-0.15, 0.15) / count;
        const double ring = std::sqrt(std::max(0.0, 1.0 - z * z));
        const double angle = turn + kGoldenAngle * i + random.uniform(-0.02, 0.02);
        const Vector at_rest{ring * std::cos(angle), ring * std::sin(angle), z};
        if (rest.cosine_at(at_rest) < config.least_cosine) continue;
        discs.push_back(
            {turned(at_rest, config.slip_rad), config.bright ? random.uniform(3.5, 5.0) : kInkPaint});
    }
    return discs;
}

// Paints one disc over its box of samples, and measures it there.
DiscTruth paint_disc(const DiscSceneConfig& config, const Head& head, const Disc& disc, std::int16_t index,
                     FineField& fine) {
    const Vector centre = head.point(disc.normal);
    DiscTruth truth;
    truth.x_px = head.x_px(centre);
    truth.y_px = head.y_px(centre);
    truth.cosine = head.cosine_at(disc.normal);
    std::copy_n(std::array{centre.x, centre.y, centre.z}.begin(), 3, truth.centre_mm);
    std::copy_n(std::array{disc.normal.x, disc.normal.y, disc.normal.z}.begin(), 3, truth.normal);
    const double reach_px = 0.6 * config.disc_mm * config.focal_px / centre.z + 1.0;
    // A point is on the disc when its way along the skin to the centre is at most half a diameter.
    const double least_dot = std::cos(0.5 * config.disc_mm / config.head_radius_mm);
    double count = 0.0;
    for (int v = fine.first(truth.y_px - reach_px); v < fine.end(truth.y_px + reach_px, fine.height()); ++v) {
        for (int u = fine.first(truth.x_px - reach_px); u < fine.end(truth.x_px + reach_px, fine.width());
             ++u) {
            Vector normal;
            double cosine = 0.0;
            const double x = FineField::pixel_of(u);
            const double y = FineField::pixel_of(v);
            if (!head.hit(x, y, normal, cosine) || dot(normal, disc.normal) < least_dot) continue;
            const double angle = config.bright ? 0.4 + 0.6 * cosine : 1.0;  // retro-reflection falls off
            fine.light(u, v) *= static_cast<float>(disc.gain * angle);
            fine.owner(u, v) = index;
            count += 1.0;
            truth.centroid_x_px += x;
            truth.centroid_y_px += y;
        }
    }
    truth.centroid_x_px /= std::max(1.0, count);
    truth.centroid_y_px /= std::max(1.0, count);
    truth.diameter_px = 2.0 * std::sqrt(count / (std::numbers::pi * kFine * kFine));
    return truth;
}

void paint_skin(const Head& head, FineField& fine) {
    for (int v = 0; v < fine.height(); ++v) {
        for (int u = 0; u < fine.width(); ++u) {
            Vector normal;
            double cosine = 0.0;
            const bool on_head = head.hit(FineField::pixel_of(u), FineField::pixel_of(v), normal, cosine);
            fine.light(u, v) = static_cast<float>(on_head ? head.skin(normal, cosine) : kBehind);
        }
    }
}

void add_texture(LightField& field, double deviation, SeededRandom& random) {
    if (deviation <= 0.0) return;
    LightField texture(field.width, field.height, 0.0);
    for (double& value : texture.values) value = random.normal(0.0, 1.0);
    blur(texture, 5.0);
    double square = 0.0;
    for (const double value : texture.values) square += value * value;
    const double scale = deviation / std::sqrt(square / static_cast<double>(texture.values.size()));
    for (std::size_t i = 0; i < field.values.size(); ++i) {
        field.values[i] *= std::max(0.0, 1.0 + scale * texture.values[i]);
    }
}

}  // namespace

double skin_level(const DiscSceneConfig& config) {
    return config.bright ? kRetroSkin : kInkSkin;
}

DiscLight light_of(const DiscSceneConfig& config) {
    SeededRandom random(config.seed);
    DiscSceneConfig at_rest = config;
    std::fill_n(at_rest.slip_mm, 3, 0.0);
    SeededRandom same = random;
    const Head rest(at_rest, same);
    const Head head(config, random);
    FineField fine(config.width_px, config.height_px);
    paint_skin(head, fine);
    std::vector<DiscTruth> discs;
    std::int16_t index = 0;
    for (const Disc& disc : place_discs(config, rest, random)) {
        discs.push_back(paint_disc(config, head, disc, index++, fine));
    }
    const Film film = disturb(config, discs, fine, random);
    fine.note_hidden(discs);
    DiscLight result{fine.pixels(), std::move(discs)};
    add_texture(result.light, config.texture, random);
    smear(result.light, film.motion_px, film.motion_rad);
    for (double& value : result.light.values) value *= film.exposure;
    blur(result.light, config.blur_px);
    return result;
}

DiscPicture render(const DiscSceneConfig& config) {
    DiscLight lit = light_of(config);
    SeededRandom random(config.seed ^ 0x5EED ^ (config.frame << 32));
    return {digitise(lit.light, config.read_noise, config.shot_noise, random), std::move(lit.discs)};
}

std::vector<TrueDot> true_dots(const DiscPicture& picture) {
    std::vector<TrueDot> dots;
    for (const DiscTruth& disc : picture.discs) {
        const bool expected = disc.cosine > kLeastExpectedCosine && disc.hidden <= kMostExpectedHidden;
        dots.push_back({disc.x_px, disc.y_px, 0.5 * disc.diameter_px / std::sqrt(disc.cosine), expected});
    }
    return dots;
}

}  // namespace rig::test
