#include "tests/support/dot_scene/disturbances.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace rig::test {

namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kHidingCover = 0.3;  // of a stain, at which a sample counts as hidden

// An ellipse or a bent stroke that tapers off. Lengths in px.
struct Stain {
    double x = 0.0;
    double y = 0.0;
    double length = 10.0;  // diameters
    double width = 10.0;
    double angle = 0.0;
    double soft = 0.5;    // width of its edge
    double factor = 1.0;  // on the light below it
    double added = 0.0;   // grey levels
    double bend = 0.0;    // 1/px; strokes only
    bool stroke = false;
    bool hides = true;
};

// 0..1 at an offset from the stain's middle, along and across it.
double cover_of(const Stain& stain, double u, double v) {
    const double a = 0.5 * stain.length;
    const double b = 0.5 * stain.width;
    if (stain.stroke) {
        if (std::abs(u) > a) return 0.0;
        const double half = b * (1.0 - 0.7 * std::abs(u) / a);
        return std::clamp((half - std::abs(v - stain.bend * u * u)) / stain.soft + 0.5, 0.0, 1.0);
    }
    const double radius = std::hypot(u / a, v / b);
    return std::clamp((1.0 - radius) * std::min(a, b) / stain.soft + 0.5, 0.0, 1.0);
}

class Painter {
  public:
    Painter(const DiscSceneConfig& config, const std::vector<DiscTruth>& discs, FineField& fine,
            SeededRandom& random)
        : c_(config),
          discs_(discs),
          fine_(fine),
          random_(random),
          mm_(config.focal_px / (config.distance_mm + 0.2 * config.head_radius_mm)),
          skin_(skin_level(config)) {}

    void glints_on_discs();
    void glints_on_skin();
    void streaks();
    void highlights();
    void nostrils();
    void lashes();
    void lip_shadow();

  private:
    void paint(const Stain& stain);
    void glint(const DiscTruth& disc, double angle, double offset, double size);
    [[nodiscard]] double far_from_discs(double x, double y) const;
    // Somewhere on the middle of the head.
    void place(double& x, double& y) {
        const double radius =
            0.75 * c_.focal_px * c_.head_radius_mm /
            std::sqrt((c_.distance_mm + c_.head_radius_mm) * (c_.distance_mm + c_.head_radius_mm) -
                      c_.head_radius_mm * c_.head_radius_mm);
        const double angle = random_.uniform(0.0, kTurn);
        const double part = std::sqrt(random_.uniform(0.0, 1.0));
        x = 0.5 * c_.width_px + radius * part * std::cos(angle);
        y = 0.5 * c_.height_px + radius * part * std::sin(angle);
    }

    const DiscSceneConfig& c_;
    const std::vector<DiscTruth>& discs_;
    FineField& fine_;
    SeededRandom& random_;
    double mm_;    // px
    double skin_;  // grey level of lit skin: the lamp that lights it makes the highlights
};

void Painter::paint(const Stain& stain) {
    const double reach = 0.5 * std::hypot(stain.length, stain.width) + stain.soft +
                         std::abs(stain.bend) * stain.length * stain.length / 4.0;
    const double c = std::cos(stain.angle);
    const double s = std::sin(stain.angle);
    for (int v = fine_.first(stain.y - reach); v < fine_.end(stain.y + reach, fine_.height()); ++v) {
        for (int u = fine_.first(stain.x - reach); u < fine_.end(stain.x + reach, fine_.width()); ++u) {
            const double dx = FineField::pixel_of(u) - stain.x;
            const double dy = FineField::pixel_of(v) - stain.y;
            const double cover = cover_of(stain, c * dx + s * dy, c * dy - s * dx);
            if (cover <= 0.0) continue;
            float& light = fine_.light(u, v);
            light = static_cast<float>(static_cast<double>(light) * (1.0 + cover * (stain.factor - 1.0)) +
                                       cover * stain.added);
            if (stain.hides && cover > kHidingCover) fine_.hide(u, v);
        }
    }
}

double Painter::far_from_discs(double x, double y) const {
    double least = 1e9;
    for (const DiscTruth& disc : discs_) {
        least = std::min(least, std::hypot(disc.x_px - x, disc.y_px - y) - 0.5 * disc.diameter_px);
    }
    return least;
}

// A spot of the lamp, that far from a disc's middle.
void Painter::glint(const DiscTruth& disc, double angle, double offset, double size) {
    paint({.x = disc.x_px + offset * std::cos(angle),
           .y = disc.y_px + offset * std::sin(angle),
           .length = size * random_.uniform(1.0, 1.8),
           .width = size,
           .angle = random_.uniform(0.0, kTurn),
           .soft = 0.5 * size,
           .added = random_.uniform(0.4, 3.5) * skin_});
}

void Painter::glints_on_discs() {
    for (const DiscTruth& disc : discs_) {
        if (!random_.chance(0.4)) continue;
        const double angle = random_.uniform(0.0, kTurn);
        const double offset = random_.uniform(0.0, 0.35) * disc.diameter_px * disc.cosine;
        const double size = random_.uniform(0.1, 0.25) * disc.diameter_px;
        glint(disc, angle, offset, size);
    }
}

void Painter::glints_on_skin() {
    for (const DiscTruth& disc : discs_) {
        if (!random_.chance(0.4)) continue;
        const double angle = random_.uniform(0.0, kTurn);
        const double offset = random_.uniform(0.6, 1.1) * disc.diameter_px;
        const double size = random_.uniform(0.15, 0.4) * disc.diameter_px;
        glint(disc, angle, offset, size);
    }
    for (int i = 0; i < 25; ++i) {
        Stain spot;
        place(spot.x, spot.y);
        spot.length = random_.uniform(0.2, 1.2) * mm_;
        spot.width = spot.length * random_.uniform(0.5, 1.0);
        spot.angle = random_.uniform(0.0, kTurn);
        spot.soft = 0.3 * spot.width;
        spot.added = random_.uniform(0.3, 3.5) * skin_;
        paint(spot);
    }
}

void Painter::streaks() {
    for (int i = 0; i < 8; ++i) {
        Stain streak;
        place(streak.x, streak.y);
        streak.stroke = true;
        streak.length = random_.uniform(8.0, 25.0) * mm_;
        streak.width = random_.uniform(0.3, 1.0) * mm_;
        streak.angle = random_.uniform(0.0, kTurn);
        streak.bend = random_.uniform(-0.01, 0.01);
        streak.soft = 0.3 * streak.width;
        streak.added = random_.uniform(0.4, 3.0) * skin_;
        paint(streak);
    }
}

// Two of the three lie with their border across a disc, as far in as a third of it.
void Painter::highlights() {
    for (int i = 0; i < 3 && !discs_.empty(); ++i) {
        Stain light;
        place(light.x, light.y);
        light.length = random_.uniform(6.0, 16.0) * mm_;
        light.width = light.length * random_.uniform(0.4, 1.0);
        light.angle = random_.uniform(0.0, kTurn);
        light.soft = random_.uniform(0.2, 1.5) * mm_;
        light.added = random_.uniform(1.0, 3.0) * skin_;
        if (i < 2) {
            const DiscTruth& disc = discs_[random_.below(discs_.size())];
            const double across = light.angle + 0.5 * std::numbers::pi;
            const double in = random_.uniform(0.0, 0.25) * disc.diameter_px * disc.cosine;
            const double from = 0.5 * light.width + 0.5 * disc.diameter_px * disc.cosine - in;
            light.x = disc.x_px + from * std::cos(across);
            light.y = disc.y_px + from * std::sin(across);
        }
        paint(light);
    }
}

// Nobody paints a marker into a nostril: they keep 1 mm off the discs.
void Painter::nostrils() {
    for (int i = 0; i < 3; ++i) {
        Stain hole;
        hole.length = random_.uniform(1.0, 3.0) * c_.disc_mm * mm_;
        hole.width = hole.length / random_.uniform(1.3, 2.4);
        hole.angle = random_.uniform(0.0, kTurn);
        hole.soft = random_.uniform(0.3, 1.2) * mm_;
        hole.factor = random_.uniform(0.04, 0.25);
        for (int attempt = 0; attempt < 200; ++attempt) {
            place(hole.x, hole.y);
            if (far_from_discs(hole.x, hole.y) > 0.5 * hole.length + mm_) break;
        }
        if (far_from_discs(hole.x, hole.y) > 0.5 * hole.length + mm_) paint(hole);
    }
}

void Painter::lashes() {
    for (int fan = 0; fan < 2; ++fan) {
        double x = 0.0;
        double y = 0.0;
        place(x, y);
        const double lid = random_.uniform(18.0, 28.0) * mm_;
        const double angle = random_.uniform(-0.4, 0.4);
        const double bend = random_.uniform(-0.008, 0.008);
        paint({.x = x,
               .y = y,
               .length = lid,
               .width = random_.uniform(0.5, 1.0) * mm_,
               .angle = angle,
               .soft = 0.5,
               .factor = random_.uniform(0.3, 0.6),
               .bend = bend,
               .stroke = true});
        const double side = random_.chance(0.5) ? 1.0 : -1.0;
        for (int i = 0; i < 14; ++i) {
            const double u = lid * ((i + 0.5) / 14.0 - 0.5);
            const double v = bend * u * u;
            const double lean =
                angle + side * (0.5 * std::numbers::pi + 1.2 * u / lid) + random_.uniform(-0.15, 0.15);
            const double length = random_.uniform(5.0, 9.0) * mm_;
            paint({.x = x + u * std::cos(angle) - v * std::sin(angle) + 0.5 * length * std::cos(lean),
                   .y = y + u * std::sin(angle) + v * std::cos(angle) + 0.5 * length * std::sin(lean),
                   .length = length,
                   .width = random_.uniform(0.15, 0.3) * mm_,
                   .angle = lean,
                   .soft = 0.25,
                   .factor = random_.uniform(0.2, 0.5),
                   .bend = random_.uniform(-0.01, 0.01),
                   .stroke = true});
        }
    }
}

void Painter::lip_shadow() {
    Stain line;
    place(line.x, line.y);
    line.stroke = true;
    line.length = random_.uniform(35.0, 50.0) * mm_;
    line.width = random_.uniform(0.8, 1.8) * mm_;
    line.angle = random_.uniform(-0.2, 0.2);
    line.bend = random_.uniform(-0.003, 0.003);
    line.soft = 0.4 * mm_;
    line.factor = random_.uniform(0.25, 0.5);
    paint(line);
    Stain shadow = line;
    shadow.stroke = false;
    shadow.hides = false;
    shadow.length = 0.8 * line.length;
    shadow.width = random_.uniform(6.0, 10.0) * mm_;
    shadow.x -= 0.4 * shadow.width * std::sin(line.angle);
    shadow.y += 0.4 * shadow.width * std::cos(line.angle);
    shadow.soft = 2.0 * mm_;
    shadow.factor = random_.uniform(0.4, 0.7);
    paint(shadow);
}

}  // namespace

FineField::FineField(int width_px, int height_px)
    : width_(width_px * kFine),
      height_(height_px * kFine),
      light_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), 0.0F),
      owner_(light_.size(), -1),
      hidden_(light_.size(), 0) {}

int FineField::first(double px) const {
    return std::max(0, static_cast<int>(std::floor((px + 0.5) * kFine)));
}

int FineField::end(double px, int limit) const {
    return std::min(limit, static_cast<int>(std::ceil((px + 0.5) * kFine)) + 1);
}

void FineField::note_hidden(std::vector<DiscTruth>& discs) const {
    std::vector<double> all(discs.size(), 0.0);
    std::vector<double> hidden(discs.size(), 0.0);
    for (std::size_t i = 0; i < owner_.size(); ++i) {
        if (owner_[i] < 0) continue;
        const auto disc = static_cast<std::size_t>(owner_[i]);
        all[disc] += 1.0;
        hidden[disc] += hidden_[i];
    }
    for (std::size_t k = 0; k < discs.size(); ++k) discs[k].hidden = all[k] == 0.0 ? 1.0 : hidden[k] / all[k];
}

LightField FineField::pixels() const {
    LightField field(width_ / kFine, height_ / kFine, 0.0);
    for (int v = 0; v < height_; ++v) {
        for (int u = 0; u < width_; ++u) {
            field.at(u / kFine, v / kFine) += static_cast<double>(light_[at(u, v)]) / (kFine * kFine);
        }
    }
    return field;
}

const char* name_of(Disturbance disturbance) {
    constexpr std::array<const char*, static_cast<std::size_t>(Disturbance::kCount)> kNames = {
        "none",   "glints on discs", "glints on skin", "streaks",     "highlights",   "nostrils",
        "lashes", "lip shadow",      "motion",         "overexposed", "underexposed", "everything"};
    return kNames[static_cast<std::size_t>(disturbance)];
}

Film disturb(const DiscSceneConfig& config, const std::vector<DiscTruth>& discs, FineField& fine,
             SeededRandom& random) {
    Painter painter(config, discs, fine, random);
    const bool all = config.disturbance == Disturbance::kEverything;
    const auto is = [&](Disturbance which) { return all || config.disturbance == which; };
    Film film;
    if (is(Disturbance::kLipShadow)) painter.lip_shadow();
    if (is(Disturbance::kNostrils)) painter.nostrils();
    if (is(Disturbance::kLashes)) painter.lashes();
    if (is(Disturbance::kStreaks)) painter.streaks();
    if (is(Disturbance::kHighlights)) painter.highlights();
    if (is(Disturbance::kGlintsOnSkin)) painter.glints_on_skin();
    if (is(Disturbance::kGlintsOnDiscs)) painter.glints_on_discs();
    if (is(Disturbance::kMotion)) {
        film.motion_px = random.uniform(1.0, all ? 2.0 : 4.0);
        film.motion_rad = random.uniform(0.0, kTurn);
    }
    if (config.disturbance == Disturbance::kOverexposed) film.exposure = random.uniform(1.8, 2.6);
    if (config.disturbance == Disturbance::kUnderexposed) film.exposure = random.uniform(0.2, 0.3);
    return film;
}

}  // namespace rig::test
